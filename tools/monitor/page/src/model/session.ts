/** The page's state as far as it comes from the server: the connection, the runs, and what is asked of them. */

import { Connection, type ConnectionState, type Listener, type Surroundings } from '../protocol/connection.ts';
import type { Channel, ServerInfo } from '../protocol/messages.ts';
import type { Decoded } from '../protocol/decoder.ts';
import { Difference } from './difference.ts';
import { pairsIn, type Pair } from './pairs.ts';
import { parseTopic, takeMessage, UNNEEDED_TOPICS } from './ingest.ts';
import { RoleQuestions } from './role_questions.ts';
import { Run } from './run.ts';

/** A notice for people, with the level of the protocol: 0 information, 1 warning, 2 error. */
export interface Notice {
  level: number;
  text: string;
}

interface SourceInfo {
  name: string;
  kind: 'live' | 'log';
  robot?: string;
  file?: string;
  begin_us?: number;
  end_us?: number;
  /** Where the log's file is wrong first; `cut`: its end is missing. */
  damage?: { cut: boolean; time_us: number; what: string } | null;
  /** The run of which this is the past. */
  past_of?: string;
}

/** Where the server tells who answers to whom in the first two sources. */
const PAIRS_TOPIC = '/pairs';

/** The share of a table that a log is loaded into at once, so that there is room to go on. */
const LOG_WINDOW = 0.9;

export class Session implements Listener {
  readonly connection: Connection;
  state: ConnectionState = 'connecting';
  retryIn = 0;
  runs: Run[] = [];
  /** Between the two runs, if there are two. */
  difference: Difference | null = null;
  /** Who answers to whom in the two runs, as the server has matched them. */
  pairs: Pair[] = [];
  /** By run what it was before the page came, as far as that is being loaded. */
  private pasts = new Map<Run, Run>();
  /** Why modules have a role or none. */
  readonly roleQuestions = new RoleQuestions((run, service, request) =>
    this.connection.call(`/${run.name}/${service}`, request),
  );
  /** Whether this page may act on live runs. */
  mayControl = false;
  /** The server has told what it shows. */
  informed = false;
  /** Messages that came, for the rate of the page itself. */
  messages = 0;
  onRuns: () => void = () => {};
  onConnection: () => void = () => {};
  onNotice: (notice: Notice) => void = () => {};
  private sessionId = '';
  private sourceNames = '';
  /** By log: up to which sim time it was asked for, seconds. */
  private readonly askedTo = new Map<Run, number>();
  /** Logs whose playback was asked for something that is not answered yet. */
  private readonly asking = new Set<Run>();

  constructor(surroundings: Surroundings) {
    this.connection = new Connection(surroundings, this, (channel) => {
      const topic = parseTopic(channel.topic);
      return channel.topic === PAIRS_TOPIC || (topic !== null && !UNNEEDED_TOPICS.includes(topic.name));
    });
  }

  onState(state: ConnectionState, retryIn: number): void {
    this.state = state;
    this.retryIn = retryIn;
    this.onConnection();
  }

  onServerInfo(info: ServerInfo): void {
    this.mayControl = info.metadata?.control === 'yes';
    const sources = parseSources(info.metadata?.sources);
    const same =
      this.informed &&
      info.sessionId === this.sessionId &&
      sources.map((s) => s.name).join() === this.sourceNames;
    this.sessionId = info.sessionId ?? '';
    this.informed = true;
    this.askedTo.clear();
    this.sourceNames = sources.map((s) => s.name).join();
    if (!same) this.setRuns(sources);
    const runs = sources.filter((source) => !source.past_of).length;
    if (runs > 2) this.onStatus(1, `The page shows two runs at most, the first two of ${runs}.`);
    this.onConnection();
  }

  onOffer(): void {
    const parameters = [...this.runs, ...this.pasts.values()].flatMap((run) => [`/${run.name}/paused`, `/${run.name}/speed`]);
    if (parameters.length) this.connection.watchParameters(parameters);
    for (const run of this.runs) {
      if (run.kind === 'log' && !this.askedTo.has(run) && this.connection.hasService(`/${run.name}/playback`))
        this.load(run, run.logBegin);
    }
    for (const past of this.pasts.values()) {
      if (!this.askedTo.has(past) && this.connection.hasService(`/${past.name}/playback`))
        this.load(past, Math.max(past.logBegin, past.logEnd - this.windowOf(past)));
    }
  }

  /** A run of that name, or the past of one. */
  private find(name: string | undefined): Run | undefined {
    return [...this.runs, ...this.pasts.values()].find((run) => run.name === name);
  }

  /** The past of a run has come: what it was goes before what it is. */
  private joinPast(past: Run): void {
    const [run] = [...this.pasts].find(([, p]) => p === past) ?? [];
    // The parameter also tells of the pause before the first message.
    if (!run || past.poses.endTime < past.logEnd - 2 * past.description.tick) return;
    this.pasts.delete(run);
    run.prepend(past);
  }

  onMessage(channel: Channel, time: number, message: Decoded): void {
    if (channel.topic === PAIRS_TOPIC) {
      this.pairs = pairsIn(message);
      this.difference?.setPairs(this.pairs);
      return;
    }
    const topic = parseTopic(channel.topic);
    const run = this.find(topic?.source);
    if (!topic || !run) return;
    this.messages++;
    takeMessage(run, topic.name, time, message);
  }

  onParameter(name: string, value: unknown): void {
    const topic = parseTopic(name);
    const run = this.find(topic?.source);
    if (!run) return;
    if (topic?.name === 'paused') run.clock.paused = value === true;
    if (topic?.name === 'paused' && value === true) this.joinPast(run);
    if (topic?.name === 'speed') run.clock.speed = typeof value === 'number' ? value : NaN;
    run.reportVersion++;
  }

  onStatus(level: number, message: string): void {
    this.onNotice({ level, text: message });
  }

  /** The oldest and the newest instant that the page can show, and whether nothing newer will come. */
  range(): { begin: number; end: number; ended: boolean } {
    let begin = NaN;
    let end = NaN;
    let ended = true;
    for (const run of this.runs) {
      if (!run.poses.length) continue;
      begin = Number.isNaN(begin) ? run.poses.beginTime : Math.min(begin, run.poses.beginTime);
      end = Number.isNaN(end) ? run.poses.endTime : Math.max(end, run.poses.endTime);
      if (run.kind === 'live' && !run.clock.ended) ended = false;
    }
    // Of two live runs the slower one decides what "now" is, so that both are shown at the same time of theirs.
    const live = this.runs.filter((run) => run.kind === 'live' && !run.clock.ended && run.poses.length);
    if (live.length) end = Math.min(...live.map((run) => run.poses.endTime));
    return { begin, end: Math.max(begin, end), ended };
  }

  /** The whole length of what is shown: that of the logs too, where they are not loaded. */
  span(): { begin: number; end: number } {
    const { begin, end } = this.range();
    const begins = [begin, ...this.runs.map((r) => r.logBegin)].filter((t) => !Number.isNaN(t));
    const ends = [end, ...this.runs.map((r) => r.logEnd)].filter((t) => !Number.isNaN(t));
    return { begin: begins.length ? Math.min(...begins) : NaN, end: ends.length ? Math.max(...ends) : NaN };
  }

  /** Sees to it that long logs are there around `time`, which the page shows. To be called now and then. */
  provide(time: number): void {
    if (this.state !== 'connected' || Number.isNaN(time)) return;
    for (const run of this.runs) {
      const asked = this.askedTo.get(run);
      if (run.kind !== 'log' || asked === undefined || !run.poses.length) continue;
      const outside = time < run.poses.beginTime - 1 || time > asked + 1;
      if (outside && time >= run.logBegin && time <= run.logEnd) {
        run.clear();
        this.load(run, Math.max(run.logBegin, time - this.windowOf(run) / 3));
      } else if (
        time > asked - this.windowOf(run) / 4 &&
        asked < run.logEnd &&
        run.poses.endTime >= asked - run.description.tick
      ) {
        this.ask(run, { playing: true, speed: 0, to_us: this.until(run, asked + this.windowOf(run) / 4) });
      }
    }
  }

  /** How much of a log was loaded of what was asked for, 0 to 1. */
  loaded(run: Run): number {
    const asked = this.askedTo.get(run);
    if (run.kind !== 'log' || asked === undefined) return run.kind === 'log' ? 0 : 1;
    if (!run.poses.length) return 0;
    const begin = run.poses.beginTime;
    if (run.poses.endTime >= asked - run.description.tick * 1.5 || run.clock.paused) return 1;
    return (run.poses.endTime - begin) / Math.max(1e-9, asked - begin);
  }

  /** Whether all is there that logs have of `time`: poses as of then, or no more of them will come. */
  has(time: number): boolean {
    return this.runs.every((run) => {
      if (run.kind === 'live') return true;
      if (!run.poses.length || this.asking.has(run) || time > (this.askedTo.get(run) ?? -Infinity) + 1e-6) return time > run.logEnd;
      return time <= run.poses.endTime || run.clock.paused;
    });
  }

  /** Gives a command to a live run, in the words of `morphbus control`. */
  command(run: Run, words: string): Promise<Decoded> {
    return this.connection.call(`/${run.name}/control`, { command: words });
  }

  deploy(run: Run, name: string, text: string, to: string): Promise<Decoded> {
    return this.connection.call(`/${run.name}/deploy`, to ? { name, text, to } : { name, text });
  }

  private setRuns(sources: readonly SourceInfo[]): void {
    const runOf = (source: SourceInfo, i: number): Run => {
      const run = new Run(source.name, source.kind, 'AB'[i]);
      run.description.robot = source.robot ?? '';
      run.file = source.file ?? '';
      if (source.kind === 'log') {
        run.logBegin = (source.begin_us ?? 0) * 1e-6;
        run.logEnd = (source.end_us ?? 0) * 1e-6;
        if (source.damage) run.damage = { ...source.damage, time: source.damage.time_us * 1e-6 };
      }
      return run;
    };
    this.runs = sources.filter((source) => !source.past_of).slice(0, 2).map(runOf);
    this.pasts.clear();
    for (const source of sources) {
      const run = this.runs.find((r) => r.name === source.past_of);
      if (run) this.pasts.set(run, runOf(source, 0));
    }
    this.pairs = [];
    this.roleQuestions.clear();
    this.difference = this.runs.length === 2 ? new Difference(this.runs[0], this.runs[1]) : null;
    this.onRuns();
  }

  private windowOf(run: Run): number {
    const rows = run.poses.capacity > 2 ? run.poses.capacity : 5000;
    return rows * run.description.tick * LOG_WINDOW;
  }

  private load(run: Run, from: number): void {
    this.ask(run, {
      playing: true,
      speed: 0,
      from_us: Math.round(from * 1e6),
      to_us: this.until(run, from + this.windowOf(run)),
    });
  }

  private until(run: Run, time: number): number {
    const end = Math.min(run.logEnd, time);
    this.askedTo.set(run, end);
    return Math.round(end * 1e6);
  }

  private ask(run: Run, request: Record<string, unknown>): void {
    this.asking.add(run);
    this.connection
      .call(`/${run.name}/playback`, request)
      .catch((error: Error) => this.onStatus(1, `${run.name}: ${error.message}`))
      .finally(() => this.asking.delete(run));
  }
}

function parseSources(text: string | undefined): SourceInfo[] {
  try {
    const list: unknown = JSON.parse(text ?? '[]');
    return Array.isArray(list) ? (list as SourceInfo[]).filter((s) => typeof s?.name === 'string') : [];
  } catch {
    return [];
  }
}
