/** The page: puts its parts together and keeps them up to date. */

import type { Run } from './model/run.ts';
import type { ModuleState, SourcePlace } from './model/run_data.ts';
import { Session } from './model/session.ts';
import { ViewClock } from './model/view_clock.ts';
import type { Surroundings } from './protocol/connection.ts';
import { ChannelsPanel } from './ui/channels_panel.ts';
import { ComparePanel } from './ui/compare_panel.ts';
import { ControlPanel } from './ui/control_panel.ts';
import type { Context, Selection } from './ui/context.ts';
import { element } from './ui/dom.ts';
import { FaultsPanel } from './ui/faults_panel.ts';
import { hashOf, layoutIn, type Layout } from './ui/layout.ts';
import { LayoutDialog } from './ui/layout_dialog.ts';
import { HeaderBar } from './ui/header_bar.ts';
import { HelpDialog } from './ui/help_dialog.ts';
import { Inspector } from './ui/inspector.ts';
import { listenForKeys } from './ui/keyboard.ts';
import { Recorder } from './ui/recorder.ts';
import { PlotsPanel } from './ui/plots_panel.ts';
import { RolesPanel } from './ui/roles_panel.ts';
import { ScenePanel } from './ui/scene_panel.ts';
import { recall } from './ui/settings.ts';
import { SourceDialog } from './ui/source_dialog.ts';
import { Tabs } from './ui/tabs.ts';
import { ThemeSwitch } from './ui/theme.ts';
import { Timeline } from './ui/timeline.ts';
import { UNKNOWN } from './view3d/palette.ts';

/** Milliseconds between updates: of plots, of the time line, of lists, and of the view for what is news of an instant that is held. */
const PLOT_INTERVAL = 33;
const TIMELINE_INTERVAL = 100;
const LIST_INTERVAL = 200;
const NEWS_INTERVAL = 200;
/** Of so many frames one draws the plots anew, where that is not more often than they need. */
const PLOT_EVERY = 3;

/** So long after its modules have taken their roles a log is shown at first, seconds. */
const OPEN_AFTER = 2;

/** A notice of the server in the words of this page. */
function noticeText(text: string): string {
  const missed = /^missed (\d+) messages/.exec(text)?.[1];
  return missed ? `This page is slower than the run: ${missed} messages were left out. What is shown is the newest.` : text;
}

function moduleColour(run: Run, module: string): string {
  return run.description.modules.find((m) => m.name === module)?.color || UNKNOWN;
}

export class App implements Context {
  readonly session: Session;
  readonly clock = new ViewClock();
  time = NaN;
  selected: Selection | null = null;
  degrees = recall('degrees', true);
  readonly scene: ScenePanel;
  readonly plots: PlotsPanel;
  readonly control: ControlPanel;
  readonly recorder: Recorder;
  private readonly timeline: Timeline;
  private readonly tabs = new Tabs();
  private readonly inspector: Inspector;
  private readonly header: HeaderBar;
  private readonly help = new HelpDialog();
  private readonly layouts: LayoutDialog;
  private readonly source = new SourceDialog();
  /** What the page's address asks for, until there are runs to show it of. */
  private asked: Layout | null = layoutIn(location.hash);
  /** Whether a log is still to be shown where there is something to see. */
  private opening = false;
  private readonly theme: ThemeSwitch;
  /** The time from one frame to the next, milliseconds: a mean of the last ones. */
  private frameTime = 0;
  private lastFrame = 0;
  private nextPlot = 0;
  private lastTimeline = 0;
  private lastList = 0;
  private shownVersion = '';
  private nextNews = 0;
  private seenFaults = 0;

  constructor(root: HTMLElement, surroundings: Surroundings) {
    this.session = new Session(surroundings);
    this.scene = new ScenePanel(this);
    this.plots = new PlotsPanel(this);
    this.control = new ControlPanel(this);
    this.recorder = new Recorder(this, this.scene, this.plots);
    this.scene.tools.append(this.recorder.button);
    this.timeline = new Timeline(this);
    this.header = new HeaderBar(
      this,
      () => this.theme.toggle(),
      () => this.help.open(),
      () => this.layouts.open(),
    );
    this.layouts = new LayoutDialog(
      () => this.layout(),
      (layout) => this.restore(layout),
      () => location.href,
      (text) => this.tell(text),
    );
    this.tabs.add('roles', 'Roles', new RolesPanel(this));
    this.tabs.add('faults', 'Faults', new FaultsPanel(this));
    this.tabs.add('channels', 'Channels', new ChannelsPanel(this));
    this.tabs.add('control', 'Control', this.control);
    this.tabs.add(
      'compare',
      'Compare',
      new ComparePanel(this, (columns) => this.plots.add(columns.map((c) => `|difference|${c}`))),
    );
    this.inspector = new Inspector(this, (fields) => this.plots.add(fields));
    this.tabs.element.append(this.inspector.element);
    root.append(
      this.header.element,
      element('main', {}, this.scene.element, this.plots.element, this.tabs.element),
      this.timeline.element,
    );
    this.theme = new ThemeSwitch((dark) => {
      this.scene.view?.setTheme(dark);
      this.plots.readTheme();
    });
    this.session.onRuns = () => this.resetRuns();
    this.session.onConnection = () => this.header.update();
    this.session.onNotice = (notice) => this.tell(noticeText(notice.text), notice.level > 0 ? 'error' : 'info');
    this.listenForKeys();
    this.resetRuns();
  }

  /** Connects, and keeps the page up to date from then on. */
  start(): void {
    this.session.connection.connect();
    const frame = (now: number): void => {
      this.frame(now);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  select(selection: Selection | null): void {
    this.selected = selection;
    if (this.scene.view) this.scene.view.selected = selection;
    this.scene.view?.touch();
    this.tabs.update();
    this.inspector.update();
  }

  seek(time: number): void {
    const { begin, end } = this.session.span();
    if (Number.isNaN(end)) return;
    this.clock.seek(Math.min(Math.max(time, begin), end));
    this.session.provide(this.clock.time);
  }

  showSource(run: Run, place: SourcePlace): void {
    const file = place.file || run.description.program;
    const text = run.description.imported.get(file) ?? run.description.programText;
    if (text && place.line) {
      this.source.open(file, text, place.line);
    } else {
      this.tell(
        `The text of ${place.file || 'the program'} is not known here; the line is ${place.line || 'unknown'}.`,
      );
    }
  }

  colourOf(run: Run, module: string): string {
    // What does nothing any more shall not look like what does.
    if (run.isLost(module, this.time)) return UNKNOWN;
    if (this.scene.view?.options.colourBy === 'module') return moduleColour(run, module);
    return this.roleColour(run.stateAt(module, this.time));
  }

  lineColourOf(run: Run, module: string): string {
    if (this.scene.view?.options.colourBy === 'module') return moduleColour(run, module);
    return this.roleColour(run.lastState(module));
  }

  /** Of two runs with unlike programs the first that names the role decides, as in the page of `compare`. */
  colourOfRole(name: string): string | null {
    for (const run of this.session.runs) {
      const known = run.description.roles.find((role) => role.name === name);
      if (known?.color) return known.color;
    }
    return null;
  }

  private roleColour(state: ModuleState | null): string {
    return (state && (this.colourOfRole(state.role) ?? state.color)) || UNKNOWN;
  }

  tell(text: string, kind: 'info' | 'error' = 'info'): void {
    this.header.tell(text, kind);
  }

  private resetRuns(): void {
    const { runs } = this.session;
    this.recorder.stop();
    this.selected = null;
    this.seenFaults = 0;
    this.clock.follow();
    // A log waits for the user.
    if (runs.length && runs.every((run) => run.kind === 'log')) {
      this.clock.seek(Math.min(...runs.map((run) => run.logBegin)));
      this.opening = true;
    }
    this.tabs.setVisible('compare', runs.length > 1);
    this.scene.reset();
    this.plots.resetRuns();
    this.header.update();
    if (runs.length && this.asked) {
      this.restore(this.asked);
      this.asked = null;
    }
  }

  /** What the page shows. */
  private layout(): Layout {
    const { selected, clock, time } = this;
    return {
      time: clock.mode === 'follow' || Number.isNaN(time) ? undefined : time,
      selected: selected ? { letter: selected.run.letter, module: selected.module } : undefined,
      tab: this.tabs.chosen,
      ...this.plots.layout,
      ...this.scene.layout,
    };
  }

  private restore(layout: Layout): void {
    this.scene.restore(layout);
    if (layout.window !== undefined) this.plots.setLength(layout.window);
    if (layout.plots) this.plots.restore(layout.plots);
    if (layout.tab) this.tabs.show(layout.tab);
    const { selected } = layout;
    const run = selected && this.session.runs.find((r) => r.letter === selected.letter);
    if (run && selected) this.select({ run, module: selected.module });
    if (layout.time === undefined) return;
    this.opening = false;
    this.clock.seek(layout.time);
  }

  /** A log opens a little after its modules have their roles, once that is known: before, nothing moves. */
  private openLog(): void {
    const { session, clock } = this;
    if (!this.opening || session.runs.some((run) => session.loaded(run) < 1)) return;
    this.opening = false;
    const { begin, end } = session.range();
    // Whoever has already looked for himself is left where he is.
    if (clock.mode !== 'hold' || clock.time > begin + 1e-6) return;
    const settled = session.runs.map((run) => run.settledTime()).filter((t) => !Number.isNaN(t));
    clock.seek(Math.min(end, (settled.length ? Math.max(...settled) : begin) + OPEN_AFTER));
  }

  private frame(now: number): void {
    this.frameTime += 0.1 * (Math.min(now - this.lastFrame, 1000) - this.frameTime);
    this.lastFrame = now;
    this.recorder.lead();
    const range = this.session.range();
    const before = this.time;
    this.time = this.clock.advance(now / 1000, range.begin, range.end, range.ended);
    // Of what the view shows, something has changed if time has, or what is known of the runs.
    const version = this.session.runs
      .map((run) => `${run.structureVersion} ${run.stateVersion} ${run.poses.length} ${run.poses.endTime}`)
      .join();
    // Beside an instant that is held news come to every frame while a log is read, which drawing holds up: it waits a little.
    const { mode } = this.clock;
    const news = version !== this.shownVersion && mode !== 'play' && (mode === 'follow' || now >= this.nextNews);
    if (this.time !== before || this.recorder.active || news) this.scene.view?.touch();
    if (news || mode === 'play') {
      this.shownVersion = version;
      this.nextNews = now + NEWS_INTERVAL;
    }
    this.scene.view?.render(this.time);
    if (now >= this.nextPlot || this.recorder.active) {
      // What is left of the time belongs to the view: a browser that draws by software has little.
      this.nextPlot = now + Math.max(PLOT_INTERVAL, PLOT_EVERY * this.frameTime);
      this.session.difference?.update();
      this.plots.update();
    }
    this.recorder.take(now / 1000);
    if (now - this.lastTimeline >= TIMELINE_INTERVAL) {
      this.lastTimeline = now;
      this.timeline.update();
    }
    if (now - this.lastList >= LIST_INTERVAL) {
      this.lastList = now;
      this.updateLists();
    }
  }

  private updateLists(): void {
    this.openLog();
    // The address has the instant at which the view holds. One that moves is not written down on the way: browsers take their
    // time for each, and refuse more than some hundred a minute.
    if (this.session.runs.length && !this.asked && this.clock.mode !== 'play') {
      const hash = `#${hashOf(this.layout())}`;
      if (hash !== location.hash) history.replaceState(null, '', hash);
    }
    this.session.provide(this.time);
    this.tabs.update();
    this.inspector.update();
    this.scene.update();
    this.header.update();
    const faults = this.session.runs.reduce((n, run) => n + run.faults.total, 0);
    const shown = this.session.runs.reduce((n, run) => n + run.numFaultsAt(this.time), 0);
    this.tabs.setBadge('faults', shown ? String(shown) : '');
    // Of several at once only the last is told.
    if (faults > this.seenFaults && this.session.runs.some((run) => run.kind === 'live')) {
      const last = this.session.runs.flatMap((run) => run.faults.list).reduce((a, b) => (b.time >= a.time ? b : a));
      this.tell(`${last.module}: ${last.text || last.name}`, 'error');
    }
    this.seenFaults = faults;
  }

  private listenForKeys(): void {
    const { scene, timeline, tabs, clock } = this;
    listenForKeys({
      Space: () => timeline.togglePlay(),
      'Shift+Space': () => this.control.toggleRun(),
      '.': () => this.session.mayControl && this.control.give('step 1'),
      ArrowLeft: () => timeline.step(-1),
      ArrowRight: () => timeline.step(1),
      'Shift+ArrowLeft': () => timeline.shift(-1),
      'Shift+ArrowRight': () => timeline.shift(1),
      Home: () => timeline.toBegin(),
      End: () => timeline.toEnd(),
      '[': () => clock.changeSpeed(-1),
      ']': () => clock.changeSpeed(1),
      f: () => scene.toggle('follow'),
      x: () => scene.toggle('frames'),
      t: () => scene.toggle('trails'),
      o: () => scene.toggle('forces'),
      v: () => scene.toggle('propagated'),
      n: () => scene.toggle('names'),
      g: () => scene.toggle('ground'),
      c: () => scene.toggleColour(),
      b: () => scene.toggleLayout(),
      r: () => scene.view?.reframe(),
      l: () => this.layouts.open(),
      m: () => this.recorder.toggle(),
      d: () => this.theme.toggle(),
      '+': () => this.plots.zoomStep(1),
      '-': () => this.plots.zoomStep(-1),
      '0': () => this.plots.reset(),
      p: () => this.plots.element.querySelector<HTMLButtonElement>('[data-action=add-plot]')?.click(),
      '?': () => this.help.open(),
      Escape: () => this.select(null),
      ...Object.fromEntries(['1', '2', '3', '4', '5'].map((key, i) => [key, () => tabs.showNumber(i)])),
    });
  }
}
