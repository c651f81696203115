/** What a run consists of, as it is told by the server: its description, reports of modules, channels, what happened. */

import type { Table } from './table.ts';

/** Reports that are kept of each kind; older ones are only counted. */
export const MAX_REPORTS = 1000;

export interface JointInfo {
  name: string;
  /** "revolute" or "prismatic": radians or metres. */
  type: string;
}

export interface ModuleInfo {
  name: string;
  type: string;
  links: string[];
  joints: JointInfo[];
  /** "#rrggbb", as in all pictures. */
  color: string;
}

/** A role, with what people may invoke. */
export interface RoleInfo {
  name: string;
  /** "#rrggbb", as in all pictures. */
  color: string;
  /** With the types of their parameters: "int", "float", "bool". */
  commands: { name: string; parameterTypes: string[] }[];
}

/** A number of the program whose value a run may choose. */
export interface ParameterInfo {
  /** "Leg.swing" for one that stands in a role. */
  name: string;
  isInt: boolean;
  /** As far as the page has heard: the run's first value, or what it was set to since. */
  value: number;
  /** Both ends of its range are allowed. */
  least: number;
  most: number;
}

/** What a run is of; parts that the server does not know are empty. */
export interface Description {
  robot: string;
  program: string;
  /** The program's text; empty if the server does not have it. */
  programText: string;
  /** Texts of the files that it imports, by their paths. */
  imported: Map<string, string>;
  /** Length of a control tick, seconds. */
  tick: number;
  modules: ModuleInfo[];
  roles: RoleInfo[];
  parameters: ParameterInfo[];
}

/** A label that a role has resolved on its module. */
export interface Label {
  name: string;
  kind: 'joint' | 'link';
  /** Name of the joint or link. */
  target: string;
  /** The joint's kinematic convention: +1 or -1 to the actuator's own sign, 0 without one. */
  sign: number;
}

/** What a module reported of itself. */
export interface ModuleState {
  module: string;
  role: string;
  /** That of its role, "#rrggbb"; grey without one. */
  color: string;
  labels: Label[];
  /** Conventions of all joints that have one. */
  signs: { joint: string; sign: number }[];
  tasks: { kind: string; function: string; line: number; file: string }[];
  /** Behaviors of the role that a fault has ended, and whether a startup of it has ended so. */
  endedBehaviors: number;
  startupEnded: boolean;
  hasPose: boolean;
  poseStale: boolean;
  frozen: boolean;
  /** The run goes on without it. */
  lost: boolean;
  /** Hash of the program that it runs, in hexadecimal. */
  program: string;
  incarnation: number;
}

/** What faults have ended of a module's program, in words; empty if nothing. */
export function endedText(state: ModuleState): string {
  const n = state.endedBehaviors;
  return [
    ...(state.startupEnded ? ['startup has ended by a fault, so nothing of the role starts'] : []),
    ...(n ? [`${n} ${n === 1 ? 'behavior has' : 'behaviors have'} ended by a fault`] : []),
  ].join(', ');
}

export interface Fault {
  time: number;
  module: string;
  role: string;
  /** Its kind. */
  name: string;
  text: string;
  file: string;
  line: number;
  /** The text of that line; empty if the server does not have the source. */
  sourceLine: string;
  function: string;
}

/** A module's program said something here. */
export interface SourcePlace {
  module: string;
  file: string;
  line: number;
}

export interface ChannelRow {
  name: string;
  type: string;
  /** Since the beginning of the log, or since the monitor listens. */
  messages: number;
  /** Messages and bytes in a second of sim time; NaN of a channel that is used once. */
  rate: number;
  bytesPerSecond: number;
  lost: number;
  bad: number;
}

export interface RunClock {
  tick: number;
  /** Sim time of that tick, seconds. */
  time: number;
  /** Whether the run holds still; of a log, whether the server's playback does. */
  paused: boolean;
  /** Times real time, as it was set; 0: as fast as possible; NaN if the server does not say. */
  speed: number;
  ended: boolean;
  endReason: string;
}

export interface ProcessHealth {
  /** Processor time used so far, seconds. */
  cpu: number;
  memoryKb: number;
  /** The first message that the process refused; empty if none. */
  refused: string;
}

/** A link's shape in its own frame: triangles as indices into points. */
export interface Shape {
  positions: Float32Array;
  indices: Uint32Array | null;
  /** For each point the colour that it keeps whatever its module's is, red, green and blue from 0 to 1, and 1; or zeros. */
  ownColours: Float32Array | null;
}

/** Something that was done to the run or to which it came, for the time line. */
export interface RunEvent {
  time: number;
  text: string;
  /** Of what a program printed. */
  place?: SourcePlace;
}

/** A list of reports that forgets the oldest ones but not how many there were. */
export class Reports<T> {
  readonly list: T[] = [];
  total = 0;

  push(report: T): void {
    this.list.push(report);
    this.total++;
    if (this.list.length > MAX_REPORTS) this.list.shift();
  }

  /** Puts those of another list before its own that are from before a time. */
  prepend(other: Reports<T>, until: number): void {
    const earlier = other.list.filter((report) => (report as { time: number }).time < until);
    this.list.unshift(...earlier);
    this.total += earlier.length;
    if (this.list.length > MAX_REPORTS) this.list.splice(0, this.list.length - MAX_REPORTS);
  }

  clear(): void {
    this.list.length = 0;
    this.total = 0;
  }
}

/** What a table of a run holds, besides the numbers. */
export interface NamedTable {
  table: Table;
  /** The unit of a column, by its name. */
  unit(column: string): string;
}

/** Columns of a link in the tables of forces, in this order: newtons along the axes of W. */
export const FORCE_AXES = ['north', 'up', 'east'] as const;
export const FORCE_COLUMNS = FORCE_AXES.map((axis) => `.${axis}`);

/** Columns of a link in the tables of poses, in this order. */
export const POSE_COLUMNS = ['x', 'y', 'z', 'qw', 'qx', 'qy', 'qz'] as const;
export const LINK_COLUMNS = POSE_COLUMNS.map((column) => `.${column}`);
