/** What people call a quantity: by the role of its module and the label of its joint or link, with the model's names behind. */

import type { Run } from './run.ts';
import type { ModuleState } from './run_data.ts';

/** What a column of a table is of. */
export interface Owner {
  module: string;
  /** Whether `part` is a joint or a link; 'module' for what is of the module as a whole, whose part is empty. */
  kind: 'joint' | 'link' | 'module';
  part: string;
  /** What of it, as in the column's name: "position", "y". */
  quantity: string;
}

/** The tables whose columns are of links. */
const LINK_TABLES = ['poses', 'propagated', 'contacts', 'pushes'];

/** The owner of a column, by the names that ingest.ts gives; null for what is of no module. */
export function ownerOf(table: string, column: string): Owner | null {
  const link = /^([^/.]+)\/([^.]+)\.(\w+)$/.exec(column);
  if (link && LINK_TABLES.includes(table))
    return { module: link[1], kind: 'link', part: link[2], quantity: link[3] };
  const joint = /^([^/.]+)\.(\S+) (.+)$/.exec(column);
  if (joint && (table === 'joints' || table === 'commands'))
    return { module: joint[1], kind: 'joint', part: joint[2], quantity: joint[3] };
  // A channel is "run/module/TOPIC"; a process's table is called by the process.
  const channel = /^[^/]+\/([^/]+)\/(\S+ .+)$/.exec(column);
  if (channel && table === 'channels') return { module: channel[1], kind: 'module', part: '', quantity: channel[2] };
  const process = /^(?:health|traces) (.+)$/.exec(table);
  return process ? { module: process[1], kind: 'module', part: '', quantity: column } : null;
}

/** The names under which a module's state has a part: its labels, in the role's order. */
export function labelsOf(state: ModuleState | null, kind: Owner['kind'], part: string): string[] {
  return (state?.labels ?? []).filter((label) => label.kind === kind && label.target === part).map((label) => label.name);
}

/** The part's name in the model: "m1.joint_1", "m1/active_block", "m1". */
export function modelName({ module, kind, part }: Owner): string {
  return kind === 'module' ? module : `${module}${kind === 'joint' ? '.' : '/'}${part}`;
}

/**
 * "FrontLeftLowerHalf.knee (m1.joint_1) position": with the role that the module had last. Without a label it is
 * "FrontLeftLowerHalf (m1.joint_1) position", and of a module that never had a role "m1.joint_1 position".
 */
export function fieldName(run: Run, table: string, column: string): string {
  const owner = ownerOf(table, column);
  if (!owner) return column;
  const state = run.lastRole(owner.module);
  const [label] = labelsOf(state, owner.kind, owner.part);
  const model = modelName(owner);
  return `${state ? `${state.role}${label ? `.${label}` : ''} (${model})` : model} ${owner.quantity}`;
}

/** All words by which people may look for a column, besides those of its name: further labels of the same part. */
export function searchText(run: Run, table: string, column: string): string {
  const owner = ownerOf(table, column);
  const labels = owner ? labelsOf(run.lastRole(owner.module), owner.kind, owner.part) : [];
  return [run.name, table, fieldName(run, table, column), column, ...labels].join(' ');
}
