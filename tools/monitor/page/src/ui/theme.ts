/** Dark or light: as the system wants it, unless the user has chosen. */

import { recall, remember } from './settings.ts';

export type Theme = 'auto' | 'light' | 'dark';

export class ThemeSwitch {
  private choice = recall<Theme>('theme', 'auto');
  private readonly system = window.matchMedia('(prefers-color-scheme: dark)');

  /** @param changed is told whether it is dark now, at first and with every change. */
  constructor(private readonly changed: (dark: boolean) => void) {
    this.system.addEventListener('change', () => this.apply());
    this.apply();
  }

  get dark(): boolean {
    return this.choice === 'auto' ? this.system.matches : this.choice === 'dark';
  }

  toggle(): void {
    const dark = !this.dark;
    // Who wants what the system wants follows the system from then on.
    this.choice = dark === this.system.matches ? 'auto' : dark ? 'dark' : 'light';
    remember('theme', this.choice);
    this.apply();
  }

  private apply(): void {
    document.documentElement.dataset.theme = this.dark ? 'dark' : 'light';
    this.changed(this.dark);
  }
}
