/** The 3D view with the switches over it, and what stands in its place while there is nothing to see. */

import { View3D, type ViewOptions } from '../view3d/view.ts';
import type { Layout } from './layout.ts';
import { trailedLinks } from './plots_panel.ts';
import type { Context, Panel } from './context.ts';
import { button, element, fill, swatch } from './dom.ts';
import { recall, remember } from './settings.ts';

type Flag = 'follow' | 'frames' | 'trails' | 'names' | 'ground' | 'propagated' | 'forces';

const FLAGS: { flag: Flag; text: string; key: string; title: string }[] = [
  { flag: 'follow', text: 'Follow', key: 'F', title: 'The camera follows the robots' },
  { flag: 'trails', text: 'Trails', key: 'T', title: 'Where labelled links were in the last seconds' },
  { flag: 'frames', text: 'Frames', key: 'X', title: 'Frames of the links of the selected module (without one, of all): x red, y green, z blue' },
  { flag: 'forces', text: 'Forces', key: 'O', title: 'Forces of the ground and of obstacles (teal) and of pushes (pink): 1 cm a newton, at most 30 cm' },
  { flag: 'propagated', text: 'Propagated', key: 'V', title: 'Where modules believe their links to be (propagated poses)' },
  { flag: 'names', text: 'Names', key: 'N', title: 'Names of modules' },
  { flag: 'ground', text: 'Ground', key: 'G', title: 'The grid on the ground' },
];

export class ScenePanel implements Panel {
  readonly element: HTMLElement;
  /** Null where the browser cannot draw in three dimensions. */
  readonly view: View3D | null;
  readonly stage = element('div', { class: 'stage' });
  private readonly message = element('div', { class: 'message', hidden: true });
  private readonly legend = element('div', { class: 'roles-legend' });
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private readonly layoutButton: HTMLButtonElement;
  /** The switches over the view. */
  readonly tools = element('div', { class: 'toolbar view-tools', role: 'toolbar', 'aria-label': 'View' });
  private shown = '';
  private messageKey = '';

  constructor(private readonly context: Context) {
    const toolbar = this.tools;
    this.element = element(
      'section',
      { class: 'scene', 'aria-label': 'View in three dimensions' },
      toolbar,
      this.stage,
    );
    this.stage.append(this.message, this.legend);
    this.view = this.makeView();
    const colour = button('Colour: role', () => this.toggleColour(), {
      title: 'Colours by role or by module (C)',
      'data-action': 'colour',
    });
    this.buttons.set('colour', colour);
    toolbar.append(colour);
    for (const { flag, text, key, title } of FLAGS) {
      const toggle = button(text, () => this.toggle(flag), {
        title: `${title} (${key})`,
        'data-action': flag,
        'aria-pressed': 'false',
      });
      this.buttons.set(flag, toggle);
      toolbar.append(toggle);
    }
    this.layoutButton = button('Beside', () => this.toggleLayout(), {
      title: 'Two robots beside or over each other (B)',
      'data-action': 'layout',
      hidden: true,
    });
    toolbar.append(
      this.layoutButton,
      element('span', { class: 'spring' }),
      button('Reset camera', () => this.view?.reframe(), {
        title: 'Camera back to where it began (R)',
        'data-action': 'camera',
      }),
    );
    this.showOptions();
  }

  private makeView(): View3D | null {
    try {
      const view = new View3D(this.stage);
      Object.assign(view.options, recall<Partial<ViewOptions>>('view', {}));
      view.colour = (run, module) => this.context.colourOf(run, module);
      view.lost = (run, module) => run.isLost(module, this.context.time);
      view.trailed = (run) => trailedLinks(run);
      view.onSelect = (selection) => this.context.select(selection);
      return view;
    } catch {
      return null;
    }
  }

  toggle(flag: Flag): void {
    if (!this.view) return;
    this.view.options[flag] = !this.view.options[flag];
    this.changed();
  }

  toggleColour(): void {
    if (!this.view) return;
    this.view.options.colourBy = this.view.options.colourBy === 'role' ? 'module' : 'role';
    this.changed();
  }

  toggleLayout(): void {
    if (!this.view) return;
    this.view.options.layout = this.view.options.layout === 'beside' ? 'over' : 'beside';
    this.view.reframe();
    this.changed();
  }

  /** What the view shows, for layouts. */
  get layout(): Pick<Layout, 'flags' | 'colourBy' | 'layout' | 'camera'> {
    if (!this.view) return {};
    const { options } = this.view;
    const flags = FLAGS.map(({ flag }) => flag).filter((flag) => options[flag]);
    return { flags, colourBy: options.colourBy, layout: options.layout, camera: this.view.cameraPlace };
  }

  restore({ flags, colourBy, layout, camera }: Layout): void {
    if (!this.view) return;
    const { options } = this.view;
    if (flags) for (const { flag } of FLAGS) options[flag] = flags.includes(flag);
    if (colourBy) options.colourBy = colourBy;
    if (layout && layout !== options.layout) {
      options.layout = layout;
      this.view.reframe();
    }
    if (camera) this.view.setCamera(camera);
    this.changed();
  }

  private changed(): void {
    if (!this.view) return;
    const { adaptive: _, translucent: __, ...options } = this.view.options;
    remember('view', options);
    this.view.touch();
    this.showOptions();
  }

  private showOptions(): void {
    const options = this.view?.options;
    if (!options) return;
    for (const { flag } of FLAGS) this.buttons.get(flag)?.setAttribute('aria-pressed', String(options[flag]));
    const colour = this.buttons.get('colour');
    if (colour) colour.textContent = `Colour: ${options.colourBy}`;
    this.layoutButton.textContent = options.layout === 'beside' ? 'Beside' : 'Over';
    this.shown = '';
  }

  /** Other runs are shown now. */
  reset(): void {
    this.view?.setRuns(this.context.session.runs);
    this.layoutButton.hidden = this.context.session.runs.length < 2;
    this.shown = '';
  }

  /** The legend of colours, and the message over an empty view. */
  update(): void {
    this.showMessage();
    if (!this.view) return;
    const { session, time } = this.context;
    const byRole = this.view.options.colourBy === 'role';
    const names = new Map<string, string>();
    for (const run of session.runs) {
      for (const module of run.moduleNames) {
        const state = run.stateAt(module, time);
        const name = state?.lost ? 'lost' : byRole ? state?.role || 'no role' : module;
        if (!names.has(name)) names.set(name, this.context.colourOf(run, module));
      }
    }
    const key = JSON.stringify([[...names], session.runs.map((r) => r.name)]);
    if (key === this.shown) return;
    this.shown = key;
    this.view.touch();
    // With many modules a legend of them all would hide the robot.
    const entries = names.size <= 16 ? [...names] : [];
    fill(this.legend, ...entries.map(([name, colour]) => element('span', {}, swatch(colour), name)));
  }

  private showMessage(): void {
    const { session } = this.context;
    const some = session.runs.some((run) => run.poses.length > 0);
    let title = '';
    let text = '';
    let example = '';
    if (!this.view) {
      title = 'This browser cannot draw in three dimensions';
      text = 'WebGL is switched off or missing. Lists, plots and the time line work all the same.';
    } else if (some) {
      // What was received stays visible when the connection is lost; the bar above says so.
    } else if (session.state !== 'connected') {
      title = session.state === 'connecting' ? 'Connecting …' : 'No connection to the monitor';
      text =
        'The page tries again by itself. If morphbus monitor has ended, start it again and open the URL that it prints.';
    } else if (!session.runs.length) {
      title = 'Nothing runs';
      text = 'Start a robot and it appears here, for example:';
      example =
        'morphbus run models/mtran.m3l models/programs/quadruped.dyn \\\n  --robot quadruped --seconds 60 --realtime';
    } else {
      title = 'Waiting for poses';
      text =
        session.runs[0].kind === 'log'
          ? 'The log is being read.'
          : 'The run has not sent any pose yet. It begins once all its processes have said hello.';
    }
    const key = title + text + example;
    if (key === this.messageKey) return;
    this.messageKey = key;
    this.message.hidden = !title;
    fill(this.message, element('h2', {}, title), element('p', {}, text), example && element('code', {}, example));
  }
}
