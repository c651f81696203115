/** The fields that can be plotted: columns of the tables of all runs, and of the table of differences. */

import type { Series } from '../plot/decimate.ts';
import type { Run } from './run.ts';
import { fixedAngles } from './pose.ts';

/** One quantity against sim time. */
export interface Field {
  /** "RUN|TABLE|COLUMN"; the same after a reload. */
  id: string;
  run: string;
  table: string;
  column: string;
  unit: string;
}

/** All fields of a run, in the order of its tables. */
export function fieldsOf(run: Run): Field[] {
  const fields: Field[] = [];
  for (const [name, { table, unit }] of run.tables) {
    for (const column of table.columnNames) {
      // Quaternions are plotted as angles.
      if (name === 'poses' && column.includes('.q')) {
        if (column.endsWith('.qw')) {
          for (const axis of ['roll', 'pitch', 'yaw']) {
            fields.push(fieldOf(run.name, name, column.replace(/qw$/, axis), 'rad'));
          }
        }
        continue;
      }
      fields.push(fieldOf(run.name, name, column, unit(column)));
    }
  }
  return fields;
}

function fieldOf(run: string, table: string, column: string, unit: string): Field {
  return { id: `${run}|${table}|${column}`, run, table, column, unit };
}

/** The parts of a field's id; null if it is none. */
export function parseFieldId(id: string): { run: string; table: string; column: string } | null {
  const parts = id.split('|');
  return parts.length === 3 ? { run: parts[0], table: parts[1], column: parts[2] } : null;
}

/** The series of a column; null if the run does not have it (yet). */
export function seriesOf(run: Run, tableName: string, column: string): { series: Series; unit: string } | null {
  const named = run.tables.get(tableName);
  if (!named) return null;
  const { table } = named;
  const angle = tableName === 'poses' ? /^(.*)\.(roll|pitch|yaw)$/.exec(column) : null;
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

/** The fields whose names hold all words of the query, in any order and case. */
export function matchFields(fields: readonly Field[], query: string): Field[] {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  return fields.filter((field) => {
    const text = `${field.run} ${field.table} ${field.column}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}
