/** Panels behind tabs, by the pattern of the ARIA authoring practices: arrow keys move between tabs. */

import type { Panel } from './context.ts';
import { element } from './dom.ts';
import { recall, remember } from './settings.ts';

interface Tab {
  id: string;
  button: HTMLButtonElement;
  badge: HTMLElement;
  panel: Panel;
  holder: HTMLElement;
}

export class Tabs {
  readonly element: HTMLElement;
  private readonly tabs: Tab[] = [];
  private readonly list = element('div', { role: 'tablist', class: 'tablist', 'aria-label': 'Lists' });
  private active = recall('tab', 'roles');

  constructor() {
    this.element = element('aside', { class: 'side', 'aria-label': 'Lists and control' }, this.list);
    this.list.addEventListener('keydown', (event) => {
      const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
      if (!step) return;
      event.stopPropagation();
      const shown = this.tabs.filter((tab) => !tab.button.hidden);
      const at = shown.findIndex((tab) => tab.id === this.active);
      const next = shown[(at + step + shown.length) % shown.length];
      this.show(next.id);
      next.button.focus();
    });
  }

  /** The tab that is chosen. */
  get chosen(): string {
    return this.active;
  }

  add(id: string, title: string, panel: Panel): void {
    const badge = element('span', { class: 'badge', hidden: true });
    const button = element(
      'button',
      { type: 'button', role: 'tab', id: `tab-${id}`, 'aria-controls': `panel-${id}`, onclick: () => this.show(id) },
      title,
      badge,
    );
    const holder = element(
      'div',
      { role: 'tabpanel', id: `panel-${id}`, 'aria-labelledby': `tab-${id}`, class: 'tabpanel' },
      panel.element,
    );
    this.tabs.push({ id, button, badge, panel, holder });
    this.list.append(button);
    this.element.append(holder);
    this.show(this.active);
  }

  show(id: string): void {
    const chosen = this.tabs.find((tab) => tab.id === id && !tab.button.hidden) ?? this.tabs[0];
    // The remembered tab may still be to come.
    if (this.tabs.some((tab) => tab.id === id)) {
      this.active = id;
      remember('tab', id);
    }
    for (const tab of this.tabs) {
      const active = tab === chosen;
      tab.button.setAttribute('aria-selected', String(active));
      tab.button.tabIndex = active ? 0 : -1;
      tab.holder.hidden = !active;
    }
    chosen?.panel.update();
  }

  /** The tab in this place, from 0, of those that are visible. */
  showNumber(index: number): void {
    const tab = this.tabs.filter((t) => !t.button.hidden)[index];
    if (tab) this.show(tab.id);
  }

  setVisible(id: string, visible: boolean): void {
    const tab = this.tabs.find((t) => t.id === id);
    if (!tab || tab.button.hidden === !visible) return;
    tab.button.hidden = !visible;
    this.show(this.active);
  }

  /** A small count beside the title; empty for none. */
  setBadge(id: string, text: string): void {
    const tab = this.tabs.find((t) => t.id === id);
    if (!tab || tab.badge.textContent === text) return;
    tab.badge.textContent = text;
    tab.badge.hidden = !text;
  }

  /** Brings the visible panel up to date. */
  update(): void {
    for (const tab of this.tabs) if (!tab.holder.hidden) tab.panel.update();
  }
}
