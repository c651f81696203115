/** The channels of the bus with rates and losses, and the processes with processor time and memory. */

import { ownerOf } from '../model/names.ts';
import type { Run } from '../model/run.ts';
import type { ChannelRow } from '../model/run_data.ts';
import { timeText } from '../plot/ticks.ts';
import { runHeading, type Context, type Panel } from './context.ts';
import { button, element, fill, heading, numberCell, row, table } from './dom.ts';
import { recall, remember } from './settings.ts';

type Key = 'name' | 'messages' | 'rate' | 'bytesPerSecond' | 'lost' | 'bad';

const COLUMNS: { key: Key; title: string; help: string }[] = [
  { key: 'name', title: 'Channel', help: 'Name on the bus, without the name of the run' },
  { key: 'messages', title: 'Count', help: 'Messages up to the instant that is shown, since the log begins or the monitor listens' },
  { key: 'rate', title: 'Hz', help: 'Messages in a second of sim time, in the last interval; none of what is said once' },
  { key: 'bytesPerSecond', title: 'kB/s', help: 'Payloads in a second of sim time, in the last interval' },
  { key: 'lost', title: 'Lost', help: 'Messages that are missing by their sequence numbers' },
  { key: 'bad', title: 'Bad', help: 'Messages that could not be decoded' },
];

export class ChannelsPanel implements Panel {
  readonly element = element('div', { class: 'panel-body' });
  private readonly body = element('div');
  private readonly filter = element('input', {
    type: 'search',
    placeholder: 'Filter channels',
    'aria-label': 'Filter channels by name or type',
    oninput: () => {
      this.shown = '';
      this.update();
    },
  });
  private order = recall<{ key: Key; descending: boolean }>('channelOrder', { key: 'name', descending: false });
  private shown = '';

  constructor(private readonly context: Context) {
    this.element.append(this.filter, this.body);
  }

  update(): void {
    const { session, time } = this.context;
    const key = JSON.stringify([
      session.runs.map((run) => run.channelsAt(time)),
      session.runs.map((run) => [...run.health]),
      this.filter.value,
      this.order,
    ]);
    if (key === this.shown) return;
    this.shown = key;
    fill(this.body, ...session.runs.flatMap((run) => this.section(run)));
  }

  private section(run: Run): HTMLElement[] {
    const title = runHeading(this.context, run);
    const channels = run.channelsAt(this.context.time);
    if (!channels.length) {
      return [
        ...title,
        element('p', { class: 'empty' }, 'No channel has been counted yet. The counts come about once a second.'),
      ];
    }
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const rows = channels.filter((c) => words.every((word) => `${c.name} ${c.type}`.toLowerCase().includes(word)));
    const { key, descending } = this.order;
    rows.sort((a, b) => (key === 'name' ? a.name.localeCompare(b.name) : a[key] - b[key]) * (descending ? -1 : 1));
    const lost = channels.reduce((n, c) => n + c.lost, 0);
    const bad = channels.reduce((n, c) => n + c.bad, 0);
    return [
      ...title,
      element(
        'p',
        { class: lost + bad ? 'warn' : 'quiet' },
        `${channels.length} channels by ${timeText(this.context.time)}, ${lost} lost, ${bad} bad`,
      ),
      table('channels', [row(...COLUMNS.map((column) => this.heading(column)))], rows.map((c) => this.row(run, c))),
      ...this.processes(run),
    ];
  }

  private heading({ key, title, help }: { key: Key; title: string; help: string }): HTMLElement {
    const active = this.order.key === key;
    const sort = (): void => {
      this.order = { key, descending: active ? !this.order.descending : key !== 'name' };
      remember('channelOrder', this.order);
      this.update();
    };
    return element(
      'th',
      {
        scope: 'col',
        class: key === 'name' ? '' : 'number',
        'aria-sort': active ? (this.order.descending ? 'descending' : 'ascending') : 'none',
      },
      button([title, active && (this.order.descending ? ' ↓' : ' ↑')], sort, { class: 'sort', title: help }),
    );
  }

  private row(run: Run, c: ChannelRow): HTMLElement {
    const name = c.name.startsWith(`${run.name}/`) ? c.name.slice(run.name.length + 1) : c.name;
    const module = ownerOf('channels', `${c.name} rate`)?.module;
    const isModule = module !== undefined && run.moduleNames.includes(module);
    return row(
      element(
        'td',
        {},
        isModule
          ? button(name, () => this.context.select({ run, module }), { class: 'pick mono', title: `Select ${module}` })
          : element('span', { class: 'mono' }, name),
        element('div', { class: 'quiet' }, c.type || 'not decoded'),
      ),
      numberCell(String(c.messages)),
      numberCell(Number.isNaN(c.rate) ? '–' : c.rate.toFixed(1)),
      numberCell(Number.isNaN(c.rate) ? '–' : (c.bytesPerSecond / 1000).toFixed(1)),
      numberCell(String(c.lost), c.lost > 0),
      numberCell(String(c.bad), c.bad > 0),
    );
  }

  private processes(run: Run): HTMLElement[] {
    if (!run.health.size) return [];
    const rows = [...run.health]
      .sort(([a], [b]) => a.localeCompare(b))
      .map(([name, health]) =>
        row(
          element('td', { class: 'mono' }, name),
          numberCell(health.cpu.toFixed(2)),
          numberCell((health.memoryKb / 1024).toFixed(1)),
          element('td', { class: 'warn' }, health.refused),
        ),
      );
    const number = { class: 'number' };
    const head = row(heading('Process'), heading('CPU s', number), heading('MiB', number), heading('Refused'));
    return [element('h3', {}, 'Processes'), table('', [head], rows)];
  }
}
