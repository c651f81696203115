/** The fields that can be plotted: columns of the tables of all runs, and of the table of differences. */

import type { Series } from '../plot/decimate.ts';
import { fieldName, searchText } from './names.ts';
import type { NamedTable, Run } from './run.ts';
import { fixedAngles } from './pose.ts';

/** One quantity against sim time. */
export interface Field {
  /** "RUN|TABLE|COLUMN"; the same after a reload. */
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
    // Quaternions are plotted as angles.
    if (name !== 'poses' || !column.includes('.q')) return [fieldOf(column, unit(column))];
    const angles = column.endsWith('.qw') ? ['roll', 'pitch', 'yaw'] : [];
    return angles.map((axis) => fieldOf(column.replace(/qw$/, axis), 'rad'));
  });
}

/** The parts of a field's id; null if it is none. */
export function parseFieldId(id: string): { run: string; table: string; column: string } | null {
  const parts = id.split('|');
  return parts.length === 3 ? { run: parts[0], table: parts[1], column: parts[2] } : null;
}

/** The series of a field's column; null if there is no such table or column (yet). */
export function seriesOf(named: NamedTable | null | undefined, column: string): { series: Series; unit: string } | null {
  if (!named) return null;
  const { table } = named;
  const angle = table.find(column) < 0 ? /^(.*)\.(roll|pitch|yaw)$/.exec(column) : null;
  const index = table.find(angle ? `${angle[1]}.qw` : column);
  if (index < 0) return null;
  // Rotations about the axes of the world: north (roll), up (yaw) and east (pitch).
  const axis = angle ? { roll: 0, yaw: 1, pitch: 2 }[angle[2] as 'roll' | 'yaw' | 'pitch'] : -1;
  const value = angle
    ? (row: number): number => {
        const v = (i: number): number => table.value(index + i, row);
        return fixedAngles([v(0), v(1), v(2), v(3)])[axis];
      }
    : (row: number): number => table.value(index, row);
  return {
    unit: angle ? 'rad' : named.unit(column),
    series: {
      get length() {
        return table.length;
      },
      time: (row) => table.time(row),
      value,
      lowerBound: (time) => table.lowerBound(time),
    },
  };
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
