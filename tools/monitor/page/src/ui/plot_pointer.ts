/** What the pointer does in a plot: hover, click, choose a stretch of time, move, zoom; with a mouse, a pad or fingers. */

import type { Plot } from '../plot/plot.ts';
import type { PlotKeeper } from './plot_view.ts';

/** A press that moves less than this is a click, CSS pixels. */
const CLICK = 4;
/** How much one notch of a wheel zooms, as a power of e for each pixel of scrolling. */
const WHEEL = 0.0015;

type Pointers = Map<number, { x: number; y: number; startX: number }>;

/** `click` gets the place on the canvas and the time under it. */
export function followPointer(
  canvas: HTMLCanvasElement,
  plot: Plot,
  keeper: PlotKeeper,
  click: (x: number, y: number, time: number) => void,
): void {
  const down: Pointers = new Map();
  const end = (): void => {
    down.clear();
    keeper.chosen = null;
  };

  canvas.addEventListener('pointerdown', (event) => {
    if (plot.timeAt(event.offsetX) === null || event.button > 1) return;
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, { x: event.offsetX, y: event.offsetY, startX: event.offsetX });
    if (event.button === 1) event.preventDefault();
  });

  canvas.addEventListener('pointermove', (event) => {
    const held = down.get(event.pointerId);
    keeper.hover = event.pointerType === 'touch' && held ? NaN : (plot.timeAt(event.offsetX) ?? NaN);
    if (!held) return;
    const moves = event.shiftKey || event.buttons === 4 || event.pointerType === 'touch';
    const before = held.x;
    held.x = event.offsetX;
    if (down.size === 2) {
      // Two fingers: as they go apart or together, the time between them stays between them.
      const [a, b] = [...down.values()];
      const now = Math.abs(a.x - b.x);
      const then = Math.abs((held === a ? before : a.x) - (held === b ? before : b.x));
      if (now > 8 && then > 8) keeper.zoom(then / now, plot.clampedTimeAt((a.x + b.x) / 2));
    } else if (moves) {
      keeper.pan(-plot.secondsOf(held.x - before));
    } else if (Math.abs(held.x - held.startX) >= CLICK) {
      const times = [held.startX, held.x].map((x) => plot.clampedTimeAt(x));
      keeper.chosen = [Math.min(...times), Math.max(...times)];
    }
  });

  canvas.addEventListener('pointerup', (event) => {
    const held = down.get(event.pointerId);
    const chosen = keeper.chosen;
    const time = plot.timeAt(event.offsetX);
    end();
    if (chosen) keeper.show(...chosen);
    else if (held && time !== null && Math.abs(event.offsetX - held.startX) < CLICK) click(event.offsetX, event.offsetY, time);
  });
  canvas.addEventListener('pointercancel', end);
  canvas.addEventListener('pointerleave', () => (keeper.hover = NaN));
  canvas.addEventListener('dblclick', () => keeper.reset());
  canvas.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const sideways = event.shiftKey ? event.deltaY : event.deltaX;
      if (Math.abs(sideways) > Math.abs(event.shiftKey ? event.deltaX : event.deltaY)) keeper.pan(plot.secondsOf(sideways));
      else keeper.zoom(Math.exp(event.deltaY * WHEEL), plot.clampedTimeAt(event.offsetX));
    },
    { passive: false },
  );
}
