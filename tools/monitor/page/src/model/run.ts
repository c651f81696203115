/** All that the page knows of one run, live or from a log: what it is of, its last minutes, what is reported of it. */

import { Table } from './table.ts';
import { compose, IDENTITY, type Pose } from './pose.ts';
import {
  type ChannelRow,
  type Description,
  type Fault,
  FORCE_COLUMNS,
  LINK_COLUMNS,
  MAX_REPORTS,
  type ModuleState,
  type NamedTable,
  type ProcessHealth,
  Reports,
  type RunClock,
  type RunEvent,
  type Shape,
  type SourcePlace,
} from './run_data.ts';

/** How much of a run's past is kept, seconds of sim time, if the memory below allows it. */
const HISTORY_SECONDS = 600;
/** Bytes that a table may take. */
const TABLE_BYTES = 64e6;

/** The pose whose columns begin at `column`, in a row; null if it is not there. */
function poseIn(table: Table, column: number, row: number): Pose | null {
  if (row < 0 || row >= table.length || column < 0) return null;
  const v = (i: number): number => table.value(column + i, row);
  if (Number.isNaN(v(0))) return null;
  return { p: [v(0), v(1), v(2)], q: [v(3), v(4), v(5), v(6)] };
}

/** Sets a pose whose columns begin at `column` in the last row. */
export function setPose(table: Table, column: number, { p, q }: Pose): void {
  for (let i = 0; i < 3; i++) table.set(column + i, p[i]);
  for (let i = 0; i < 4; i++) table.set(column + 3 + i, q[i]);
}

export class Run {
  readonly description: Description = {
    robot: '',
    program: '',
    programText: '',
    imported: new Map(),
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
  /** Where the log's file is wrong first, seconds, and what is; `cut`: its end is missing. Null if it is whole. */
  damage: { cut: boolean; time: number; what: string } | null = null;
  /** Types of the channels that were heard of. */
  readonly channelTypes = new Map<string, string>();
  /** Mated connectors, each "m1.c2 – m2.c5", and since when, in order of time. */
  readonly connections: { time: number; list: string[] }[] = [];
  /** The newest message of each topic, as it was decoded, with its sim time in seconds. */
  readonly newest = new Map<string, { time: number; message: Record<string, unknown> }>();
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
  private names: string[] = [];
  private namesKey = '';
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
      poses.length * LINK_COLUMNS.length,
    );
    this.rewind(time);
    this.poses.row(time);
    for (const { link, pose } of poses) {
      const first = this.poses.columnsOf(link, LINK_COLUMNS);
      if (first === this.links.length * LINK_COLUMNS.length) {
        this.links.push(link);
        this.structureVersion++;
      }
      setPose(this.poses, first, pose);
    }
  }

  /** The pose of a link in a row of `poses`; null if it is not in it. */
  pose(link: number, row: number): Pose | null {
    return link < 0 ? null : poseIn(this.poses, link * LINK_COLUMNS.length, row);
  }

  /** Where its module believed a link to be at a time, in the world; null if that is not known. */
  propagatedPose(link: string, time: number): Pose | null {
    const propagated = this.tables.get('propagated')?.table;
    const robot = this.tables.get('robot frame')?.table;
    if (!propagated || !robot) return null;
    const X_RL = poseIn(propagated, propagated.find(`${link}.x`), propagated.rowAt(time + 1e-9));
    const X_WR = poseIn(robot, robot.find('x'), robot.rowAt(time + 1e-9));
    return X_RL && X_WR && compose(X_WR, X_RL);
  }

  /** What pushed which links at a time, by the table of these forces, in newtons along the axes of W. */
  forcesAt(table: string, time: number): { link: string; force: [number, number, number] }[] {
    const named = this.tables.get(table);
    const row = named?.table.rowAt(time + 1e-9) ?? -1;
    if (!named || row < 0) return [];
    const names = named.table.columnNames;
    const forces: { link: string; force: [number, number, number] }[] = [];
    for (let c = 0; c + 2 < names.length; c += FORCE_COLUMNS.length) {
      const force = [0, 1, 2].map((i) => named.table.value(c + i, row) || 0) as [number, number, number];
      if (force.some((f) => f !== 0)) forces.push({ link: names[c].slice(0, -FORCE_COLUMNS[0].length), force });
    }
    return forces;
  }

  /** A pose in R as one in the world. */
  inWorld(X_RL: Pose): Pose {
    return compose(this.X_WR, X_RL);
  }

  linkIndex(link: string): number {
    const column = this.poses.find(link + LINK_COLUMNS[0]);
    return column < 0 ? -1 : column / LINK_COLUMNS.length;
  }

  /**
   * What a module reported, from `time` on. A report that repeats the last one is passed over; one of which its tasks alone are
   * new takes the last one's place, as tasks move on in every tick of a program that traces fields.
   */
  takeState(time: number, state: ModuleState): void {
    let list = this.states.get(state.module);
    if (!list) this.states.set(state.module, (list = []));
    const last = list[list.length - 1];
    if (last && JSON.stringify(last.state) === JSON.stringify(state)) return;
    if (last && JSON.stringify({ ...last.state, tasks: state.tasks }) === JSON.stringify(state)) {
      last.state = state;
      this.stateVersion++;
      return;
    }
    if (last && last.state.role !== state.role) {
      this.addEvent(time, `${state.module}: ${state.role || 'no role'}`);
    }
    if (state.lost && !last?.state.lost) this.addEvent(time, `${state.module} is lost; the run goes on without it`);
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

  /** When any module last reported something new until then; NaN if none had. */
  stateTime(time: number): number {
    let latest = NaN;
    for (const list of this.states.values()) {
      for (const entry of list) if (entry.time <= time && !(entry.time <= latest)) latest = entry.time;
    }
    return latest;
  }

  /** Since when it has had the role, or none, that it had at a time; NaN if it had said nothing. */
  roleSince(module: string, time: number): number {
    const list = (this.states.get(module) ?? []).filter((entry) => entry.time <= time);
    const role = list.at(-1)?.state.role;
    let since = NaN;
    for (let i = list.length - 1; i >= 0 && list[i].state.role === role; i--) since = list[i].time;
    return since;
  }

  /** What a module's connectors are mated with at a time: its connector, the other module, and that one's connector. */
  neighboursAt(module: string, time: number): [string, string, string][] {
    const known = this.connections.filter((entry) => entry.time <= time).at(-1) ?? this.connections[0];
    return (known?.list ?? []).flatMap((connection) => {
      const [a, b] = connection.split(' – ').map((side) => side.split('.'));
      if (a[0] === module) return [[a[1], b[0], b[1]] as [string, string, string]];
      return b[0] === module ? [[b[1], a[0], a[1]] as [string, string, string]] : [];
    });
  }

  /** What the channels had said by a time, as far as that was told. */
  channelsAt(time: number): ChannelRow[] {
    const table = this.tables.get('channels')?.table;
    const row = table?.rowAt(time + 1e-9) ?? -1;
    if (!table || row < 0) return [];
    const value = (column: string): number => {
      const index = table.find(column);
      return index < 0 ? NaN : table.value(index, row);
    };
    return [...this.channelTypes].flatMap(([name, type]) => {
      const messages = value(`${name} count`);
      // A channel that was not heard of by then has no row.
      if (!(messages > 0)) return [];
      const [rate, bytesPerSecond] = [value(`${name} rate`), value(`${name} bandwidth`)];
      return [{ name, type, messages, rate, bytesPerSecond, lost: value(`${name} lost`), bad: value(`${name} bad`) }];
    });
  }

  /** Whether the run went on without a module at that time. */
  isLost(module: string, time: number): boolean {
    return this.stateAt(module, time)?.lost ?? false;
  }

  /** What it has reported last. */
  lastState(module: string): ModuleState | null {
    const list = this.states.get(module);
    return list?.length ? list[list.length - 1].state : null;
  }

  /** What it reported when it had a role last; null if it never had one. */
  lastRole(module: string): ModuleState | null {
    return this.states.get(module)?.filter(({ state }) => state.role).at(-1)?.state ?? null;
  }

  /** The last role that it had until then; empty if none. */
  roleBefore(module: string, time: number): string {
    const list = this.states.get(module) ?? [];
    return list.filter((entry) => entry.time <= time && entry.state.role).at(-1)?.state.role ?? '';
  }

  /** Names of all modules, those of the description first. */
  get moduleNames(): readonly string[] {
    // They are asked for all the time, and of a large robot there are many.
    const key = `${this.structureVersion} ${this.states.size} ${this.links.length}`;
    if (key !== this.namesKey) {
      this.namesKey = key;
      const links = this.links.map((link) => link.split('/')[0]);
      this.names = [...new Set([...this.description.modules.map((m) => m.name), ...this.states.keys(), ...links])];
    }
    return this.names;
  }

  takeFault(fault: Fault): void {
    this.faults.push(fault);
    this.reportVersion++;
  }

  /** How many faults had come by a time; older ones than those that are kept all count. */
  numFaultsAt(time: number): number {
    const { list, total } = this.faults;
    return total - list.length + list.filter((fault) => fault.time <= time + 1e-9).length;
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

  /** Takes up what came before all that is known: of a run that had gone on before the page came. */
  prepend(past: Run): void {
    for (const [name, { table, unit }] of past.tables) {
      const known = this.tables.get(name)?.table;
      const joined = new Table(Math.max(known?.capacity ?? 0, table.capacity));
      // Columns keep their places.
      for (const column of known?.columnNames ?? []) joined.column(column);
      joined.append(table, known?.length ? known.beginTime : Infinity);
      if (known) joined.append(known, Infinity);
      this.tables.set(name, { table: joined, unit });
      if (name === 'poses') this.poses = joined;
    }
    for (const link of past.links) if (!this.links.includes(link)) this.links.push(link);
    for (const [module, states] of past.states) {
      const known = this.states.get(module) ?? [];
      const before = states.filter((entry) => !known.length || entry.time < known[0].time);
      this.states.set(module, [...before, ...known]);
    }
    const from = (reports: readonly { time: number }[]): number => reports[0]?.time ?? Infinity;
    this.faults.prepend(past.faults, from(this.faults.list));
    this.events.prepend(past.events, from(this.events.list));
    this.connections.unshift(...past.connections.filter((entry) => entry.time < from(this.connections)));
    for (const [name, type] of past.channelTypes) if (!this.channelTypes.has(name)) this.channelTypes.set(name, type);
    this.structureVersion++;
    this.stateVersion++;
    this.reportVersion++;
  }

  /** When every module that had a role at all had one for the first time; NaN if none had. */
  settledTime(): number {
    const firsts = [...this.states.values()].flatMap((list) => list.find(({ state }) => state.role)?.time ?? []);
    return firsts.length ? Math.max(...firsts) : NaN;
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
    while (this.connections.length && this.connections[this.connections.length - 1].time > time) this.connections.pop();
    this.stateVersion++;
    this.reportVersion++;
  }

  /** Forgets the past, because what comes next does not follow on it. */
  clear(): void {
    for (const { table } of this.tables.values()) table.clear();
    this.states.clear();
    this.connections.length = 0;
    this.faults.clear();
    this.events.clear();
    this.stateVersion++;
    this.reportVersion++;
  }
}
