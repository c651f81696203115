/** The fields that can be plotted: columns of the tables of all runs, what follows from them, and what two runs have in common. */

import type { Series } from '../plot/decimate.ts';
import { differenceOf, mapped, rateOf, speedOf } from './derived.ts';
import { fieldName, ownerOf, searchText } from './names.ts';
import { signAt, type Pair } from './pairs.ts';
import { fixedAngles, rotate, type Vector } from './pose.ts';
import type { Run } from './run.ts';
import type { NamedTable } from './run_data.ts';
import type { Session } from './session.ts';

/** One quantity against sim time. */
export interface Field {
  /**
   * "RUN|TABLE|COLUMN", with "|rate" behind it for how fast it changes; the same after a reload. What is of no run alone
   * has no RUN: the table "difference", and "pairs", in which a field is a line of either run.
   */
  id: string;
  run: string;
  table: string;
  column: string;
  unit: string;
  /** What people read. */
  name: string;
  /** What they may search for. */
  words: string;
}

/** One line of a field in a plot. */
export interface FieldLine {
  series: Series;
  unit: string;
  /** Null for what is of no run alone. */
  run: Run | null;
  /** The module that it is of; null if of none. */
  module: string | null;
  name: string;
}

/** Of two runs what is compared joint by joint and link by link. */
const PAIR_JOINT = ['position', 'velocity', 'effort', 'target'];
const PAIR_LINK = ['x', 'y', 'z'];
/** What is behind a pair's quantity for A's value less B's. */
const MINUS = ' A − B';

/** All fields of a run, in the order of its tables. */
export function fieldsOf(run: Run): Field[] {
  return [...run.tables].flatMap(([name, named]) => fieldsIn(run, name, named));
}

/** The fields of one table; `run` is null for a table that is of no run alone. */
export function fieldsIn(run: Run | null, name: string, { table, unit }: NamedTable): Field[] {
  const fieldOf = (column: string, of: string): Field => ({
    id: `${run?.name ?? ''}|${name}|${column}`,
    run: run?.name ?? '',
    table: name,
    column,
    unit: of,
    name: run ? fieldName(run, name, column) : column,
    words: run ? searchText(run, name, column) : `${name} ${column}`,
  });
  return table.columnNames.flatMap((column) => {
    const fields = [fieldOf(column, unit(column))];
    // A joint that was told where to go is off by something.
    if (name === 'joints' && column.endsWith(' target')) fields.push(fieldOf(column.replace(/target$/, 'error'), unit(column)));
    if (name !== 'poses' && name !== 'propagated') return fields;
    if (column.endsWith('.z')) fields.push(fieldOf(column.replace(/z$/, 'speed'), 'm/s'));
    // Quaternions are plotted as angles.
    if (!column.includes('.q')) return fields;
    const angles = column.endsWith('.qw') ? ['roll', 'pitch', 'yaw'] : [];
    return angles.map((axis) => fieldOf(column.replace(/qw$/, axis), 'rad'));
  });
}

/** What two runs have in common: each quantity of a pair is one field, and so is its difference. */
function pairFields(session: Session): Field[] {
  const [a, b] = session.runs;
  return session.pairs.flatMap((pair) => {
    const joint = pair.kind === 'joint';
    return (joint ? PAIR_JOINT : PAIR_LINK).flatMap((quantity) => {
      const unit = unitOfPair(session, pair, quantity);
      if (unit === null) return [];
      const where = joint ? '.' : '/';
      const parts = `${pair.moduleA}${where}${pair.partA} / ${pair.moduleB}${where}${pair.partB}`;
      return ['', MINUS].map((suffix) => {
        const column = `${pair.name} ${quantity}${suffix}`;
        const name = `${pair.name} (${parts}) ${quantity}${suffix}`;
        const words = `pairs ${name} ${suffix ? 'difference' : ''} ${a.name} ${b.name}`;
        return { id: `|pairs|${column}`, run: '', table: 'pairs', column, unit, name, words };
      });
    });
  });
}

/**
 * All that can be plotted. Of two runs that are matched, what is paired is listed as such and not once more run by run,
 * where the same motion may have opposite signs.
 */
export function allFields(session: Session): Field[] {
  const paired = pairFields(session);
  const [a, b] = session.runs;
  const taken = new Set(
    session.pairs.flatMap((pair) =>
      (pair.kind === 'joint' ? PAIR_JOINT : PAIR_LINK).flatMap((quantity) => [
        `${a?.name}|${columnOf(pair.kind, pair.moduleA, pair.partA, quantity)}`,
        `${b?.name}|${columnOf(pair.kind, pair.moduleB, pair.partB, quantity)}`,
      ]),
    ),
  );
  return [
    ...paired,
    ...(session.difference ? fieldsIn(null, 'difference', session.difference) : []),
    ...session.runs.flatMap(fieldsOf).filter((field) => !taken.has(field.id)),
  ];
}

/** "joints|m1.joint_1 position", "poses|m1/tip.y". */
function columnOf(kind: Pair['kind'], module: string, part: string, quantity: string): string {
  return kind === 'joint' ? `joints|${module}.${part} ${quantity}` : `poses|${module}/${part}.${quantity}`;
}

/** The unit of a pair's quantity by A's table; null if there is no such column. */
function unitOfPair(session: Session, pair: Pair, quantity: string): string | null {
  const [table, column] = columnOf(pair.kind, pair.moduleA, pair.partA, quantity).split('|');
  const named = session.runs[0]?.tables.get(table);
  return named && named.table.find(column) >= 0 ? named.unit(column) : null;
}

/** The parts of a field's id; null if it is none. */
export function parseFieldId(id: string): { run: string; table: string; column: string; rate: boolean } | null {
  const parts = id.split('|');
  const known = parts.length === 3 || (parts.length === 4 && parts[3] === 'rate');
  return known ? { run: parts[0], table: parts[1], column: parts[2], rate: parts.length === 4 } : null;
}

/** The lines of a field: two of a pair, A's first; none while there is no such table or column (yet). */
export function linesOf(session: Session, id: string): FieldLine[] {
  const parsed = parseFieldId(id);
  if (!parsed) return [];
  const lines = plainLines(session, parsed);
  if (!parsed.rate) return lines;
  return lines.map((line) => ({ ...line, series: rateOf(line.series), unit: rateUnit(line.unit), name: `d/dt ${line.name}` }));
}

function rateUnit(unit: string): string {
  return unit.endsWith('/s') ? unit.replace(/\/s$/, '/s²') : `${unit || '1'}/s`;
}

function plainLines(session: Session, { run: name, table, column }: { run: string; table: string; column: string }): FieldLine[] {
  if (table === 'pairs') return pairLines(session, column);
  const run = session.runs.find((r) => r.name === name) ?? null;
  const found = seriesOf(table === 'difference' ? session.difference : run?.tables.get(table), column);
  if (!found) return [];
  return [{ ...found, run, module: ownerOf(table, column)?.module ?? null, name: run ? lineName(session, run, table, column) : column }];
}

/** Short enough for a legend: the run's letter where there are two, the table's name where the column does not speak for itself. */
function lineName(session: Session, run: Run, table: string, column: string): string {
  const plain = table === 'poses' || table === 'joints' || table === 'channels';
  const letter = session.runs.length > 1 ? `${run.letter} ` : '';
  return `${letter}${plain ? '' : `${table} `}${fieldName(run, table, column)}`;
}

/** A's and B's line under one sign and, of links, of the same point of both robots; or their difference. */
function pairLines(session: Session, column: string): FieldLine[] {
  const minus = column.endsWith(MINUS);
  const plain = minus ? column.slice(0, -MINUS.length) : column;
  const pair = session.pairs.find(
    (p) => plain.startsWith(`${p.name} `) && !plain.slice(p.name.length + 1).includes(' '),
  );
  if (!pair) return [];
  const quantity = plain.slice(pair.name.length + 1);
  const lines = [0, 1].flatMap((i): FieldLine[] => {
    const run = session.runs[i];
    const [module, part] = i === 0 ? [pair.moduleA, pair.partA] : [pair.moduleB, pair.partB];
    const [table, name] = columnOf(pair.kind, module, part, quantity).split('|');
    const named = run?.tables.get(table);
    const found = pair.kind === 'link' && i === 1 ? pointOfB(session, pair, quantity) : seriesOf(named, name);
    if (!found || !run) return [];
    const spans = i === 0 ? pair.signsA : pair.signsB;
    const series =
      pair.kind === 'joint'
        ? mapped(found.series, (row) => found.series.value(row) * signAt(spans, found.series.time(row)))
        : found.series;
    return [{ series, unit: found.unit, run, module, name: lineName(session, run, table, name) }];
  });
  if (!minus) return lines;
  if (lines.length < 2) return [];
  return [{ ...lines[0], series: differenceOf(lines[0].series, lines[1].series), run: null, name: column }];
}

/** A coordinate of the point of B's link that lay at the origin of A's when the comparison began. */
function pointOfB(session: Session, pair: Pair, axis: string): { series: Series; unit: string } | null {
  const b = session.runs[1];
  const point = session.difference?.pointInB(`${pair.moduleA}/${pair.partA}`) ?? [0, 0, 0];
  const x = b.poses.find(`${pair.moduleB}/${pair.partB}.x`);
  if (x < 0) return null;
  const table = b.poses;
  const i = PAIR_LINK.indexOf(axis);
  const value = (row: number): number => {
    const at = (k: number): number => table.value(x + k, row);
    return at(i) + rotate([at(3), at(4), at(5), at(6)], point as Vector)[i];
  };
  return { unit: 'm', series: mapped(tableSeries(table, x), value) };
}

function tableSeries(table: NamedTable['table'], column: number): Series {
  return {
    get length() {
      return table.length;
    },
    time: (row) => table.time(row),
    value: (row) => table.value(column, row),
    lowerBound: (time) => table.lowerBound(time),
  };
}

/** The series of a field's column; null if there is no such table or column (yet). */
export function seriesOf(named: NamedTable | null | undefined, column: string): { series: Series; unit: string } | null {
  if (!named) return null;
  const { table } = named;
  const index = table.find(column);
  if (index >= 0) return { unit: named.unit(column), series: tableSeries(table, index) };
  return followingSeries(named, column);
}

/** What follows from several columns: angles from quaternions, the speed of a link, how far a joint is from its target. */
function followingSeries(named: NamedTable, column: string): { series: Series; unit: string } | null {
  const { table } = named;
  const parts = /^(.*)([. ])(roll|pitch|yaw|speed|error)$/.exec(column);
  if (!parts) return null;
  const [, owner, separator, quantity] = parts;
  const indexOf = (name: string): number => table.find(`${owner}${separator}${name}`);
  if (quantity === 'error') {
    const [target, position] = [indexOf('target'), indexOf('position')];
    if (target < 0 || position < 0) return null;
    const value = (row: number): number => table.value(target, row) - table.value(position, row);
    return { unit: named.unit(`${owner} position`), series: mapped(tableSeries(table, target), value) };
  }
  if (quantity === 'speed') {
    const x = indexOf('x');
    if (separator !== '.' || x < 0) return null;
    return { unit: 'm/s', series: speedOf([0, 1, 2].map((i) => tableSeries(table, x + i))) };
  }
  const w = indexOf('qw');
  if (w < 0) return null;
  // Rotations about the axes of the world: north (roll), up (yaw) and east (pitch).
  const axis = { roll: 0, yaw: 1, pitch: 2 }[quantity as 'roll' | 'yaw' | 'pitch'];
  const value = (row: number): number => {
    const v = (i: number): number => table.value(w + i, row);
    return fixedAngles([v(0), v(1), v(2), v(3)])[axis];
  };
  return { unit: 'rad', series: mapped(tableSeries(table, w), value) };
}

/** The fields whose names hold all words of the query, in any order and case; those that have them as whole words first. */
export function matchFields(fields: readonly Field[], query: string): Field[] {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  const found: { field: Field; whole: number }[] = [];
  for (const field of fields) {
    const text = field.words.toLowerCase();
    if (!words.every((word) => text.includes(word))) continue;
    const parts = text.split(/[^\p{L}\p{N}_]+/u);
    found.push({ field, whole: words.filter((word) => parts.includes(word)).length });
  }
  return found.sort((a, b) => b.whole - a.whole).map(({ field }) => field);
}
