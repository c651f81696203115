/** All that the page knows of one run, live or from a log: what it is of, its last minutes, what is reported of it. */

import { Table } from './table.ts';
import { compose, IDENTITY, type Pose } from './pose.ts';

/** How much of a run's past is kept, seconds of sim time, if the memory below allows it. */
const HISTORY_SECONDS = 600;
/** Bytes that a table may take. */
const TABLE_BYTES = 64e6;
/** Reports that are kept of each kind; older ones are only counted. */
const MAX_REPORTS = 1000;

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
  tasks: { kind: string; function: string; line: number }[];
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
  messages: number;
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

/** Columns of a link in the table of poses, in this order. */
export const POSE_COLUMNS = ['x', 'y', 'z', 'qw', 'qx', 'qy', 'qz'] as const;

export class Run {
  readonly description: Description = {
    robot: '',
    program: '',
    programText: '',
    tick: 0.02,
    modules: [],
    roles: [],
    parameters: [],
  };
  /** Poses of links in the world: north, up, east. */
  poses = new Table(2);
  /** Link names, "module/link", in the order of the columns of `poses`, seven each. */
  readonly links: string[] = [];
  readonly shapes = new Map<string, Shape>();
  /** What stands in the world beside the robot, by name; corners in W. */
  readonly obstacles = new Map<string, Shape>();
  readonly tables = new Map<string, NamedTable>();
  readonly faults = new Reports<Fault>();
  readonly events = new Reports<RunEvent>();
  readonly clock: RunClock = { tick: -1, time: NaN, paused: false, speed: NaN, ended: false, endReason: '' };
  /** The log's file; empty for a live run. */
  file = '';
  channels: ChannelRow[] = [];
  /** Mated connectors as "m1.c2 – m2.c5". */
  connections: string[] = [];
  /** The last ledger of each process. */
  readonly health = new Map<string, ProcessHealth>();
  /** Where the robot frame R lies in the world, for a run that has no simulated world. */
  X_WR: Pose = IDENTITY;
  /** First and last instant of a log, seconds; NaN for a live run. */
  logBegin = NaN;
  logEnd = NaN;
  /** Grow whenever links or shapes, or states of modules, or reports change: views compare them to what they drew. */
  structureVersion = 0;
  stateVersion = 0;
  reportVersion = 0;
  private readonly states = new Map<string, { time: number; state: ModuleState }[]>();

  /**
   * @param name as in the topics.
   * @param kind "live" or "log".
   * @param letter A or B, by which the page calls it.
   */
  constructor(
    readonly name: string,
    readonly kind: 'live' | 'log',
    readonly letter: string,
  ) {}

  /** The table of that name, which is added if there is none. `columns`: about how many it will have. */
  addTable(name: string, unit: (column: string) => string, columns: number): Table {
    const known = this.tables.get(name);
    if (known) return known.table;
    const rows = Math.max(
      500,
      Math.min(HISTORY_SECONDS / this.description.tick, Math.floor(TABLE_BYTES / 8 / (columns + 1))),
    );
    const table = new Table(rows);
    this.tables.set(name, { table, unit });
    return table;
  }

  /** Appends poses of links at one instant; links that were unknown become known. */
  takePoses(time: number, poses: readonly { link: string; pose: Pose }[]): void {
    if (!Number.isFinite(time)) return;
    this.poses = this.addTable(
      'poses',
      (column) => (column.includes('.q') ? '' : 'm'),
      poses.length * POSE_COLUMNS.length,
    );
    this.rewind(time);
    this.poses.row(time);
    for (const { link, pose } of poses) {
      const first = this.poses.column(`${link}.x`);
      if (first === this.links.length * POSE_COLUMNS.length) {
        for (const c of POSE_COLUMNS) this.poses.column(`${link}.${c}`);
        this.links.push(link);
        this.structureVersion++;
      }
      for (let i = 0; i < 3; i++) this.poses.set(first + i, pose.p[i]);
      for (let i = 0; i < 4; i++) this.poses.set(first + 3 + i, pose.q[i]);
    }
  }

  /** The pose of a link in a row of `poses`; null if it is not in it. */
  pose(link: number, row: number): Pose | null {
    if (row < 0 || row >= this.poses.length || link < 0) return null;
    const c = link * POSE_COLUMNS.length;
    const x = this.poses.value(c, row);
    if (Number.isNaN(x)) return null;
    const v = (i: number): number => this.poses.value(c + i, row);
    return { p: [x, v(1), v(2)], q: [v(3), v(4), v(5), v(6)] };
  }

  /** A pose in R as one in the world. */
  inWorld(X_RL: Pose): Pose {
    return compose(this.X_WR, X_RL);
  }

  linkIndex(link: string): number {
    return this.links.indexOf(link);
  }

  /** What a module reported, from `time` on. A report that repeats the last one is passed over. */
  takeState(time: number, state: ModuleState): void {
    let list = this.states.get(state.module);
    if (!list) this.states.set(state.module, (list = []));
    const last = list[list.length - 1];
    if (last && JSON.stringify(last.state) === JSON.stringify(state)) return;
    if (last && last.state.role !== state.role) {
      this.addEvent(time, `${state.module}: ${state.role || 'no role'}`);
    }
    if (last && last.state.program !== state.program) {
      this.addEvent(time, `${state.module} runs another program`);
    }
    list.push({ time, state });
    if (list.length > MAX_REPORTS) list.shift();
    this.stateVersion++;
  }

  /** What the module had last reported at that time; null if nothing. */
  stateAt(module: string, time: number): ModuleState | null {
    const list = this.states.get(module);
    if (!list) return null;
    for (let i = list.length - 1; i >= 0; i--) {
      if (list[i].time <= time) return list[i].state;
    }
    // Who came later than the report sees the oldest one that is known.
    return list.length ? list[0].state : null;
  }

  /** What it has reported last. */
  lastState(module: string): ModuleState | null {
    const list = this.states.get(module);
    return list?.length ? list[list.length - 1].state : null;
  }

  /** Names of all modules, those of the description first. */
  get moduleNames(): string[] {
    const names = this.description.modules.map((m) => m.name);
    for (const name of this.states.keys()) if (!names.includes(name)) names.push(name);
    for (const link of this.links) {
      const name = link.split('/')[0];
      if (!names.includes(name)) names.push(name);
    }
    return names;
  }

  takeFault(fault: Fault): void {
    this.faults.push(fault);
    this.reportVersion++;
  }

  /** Takes note of "set swing 45 …", a command that CLOCK names. */
  takeSetting(command: string): void {
    const [kind, name, value] = command.split(' ');
    if (kind !== 'set') return;
    // The role may be left out where no parameter has the whole name.
    const { parameters } = this.description;
    const parameter =
      parameters.find((p) => p.name === name) ?? parameters.find((p) => p.name.endsWith(`.${name}`));
    if (parameter) parameter.value = Number(value);
    this.structureVersion++;
  }

  /** @param place where in the program it was said, and by whom. */
  addEvent(time: number, text: string, place?: SourcePlace): void {
    this.events.push({ time, text, place });
    this.reportVersion++;
  }

  /** Sim time steps back when a log is wound back: what was reported of later times goes. */
  private rewind(time: number): void {
    if (!(time < this.poses.endTime)) return;
    for (const list of this.states.values()) {
      while (list.length && list[list.length - 1].time > time) list.pop();
    }
    const earlier = <T extends { time: number }>(reports: Reports<T>): void => {
      while (reports.list.length && reports.list[reports.list.length - 1].time > time) {
        reports.list.pop();
        reports.total--;
      }
    };
    earlier(this.faults);
    earlier(this.events);
    this.stateVersion++;
    this.reportVersion++;
  }

  /** Forgets the past, because what comes next does not follow on it. */
  clear(): void {
    for (const { table } of this.tables.values()) table.clear();
    this.states.clear();
    this.faults.clear();
    this.events.clear();
    this.stateVersion++;
    this.reportVersion++;
  }
}
