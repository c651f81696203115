/** A picture of what is seen: the view with the text over it and, where wanted, the plots below it. */

/** How wide a picture is at least, pixels: a narrow view is drawn finer. */
const LEAST_WIDTH = 1280;
/** Codecs halve the resolution of colours, and want sizes that can be halved. */
const even = (size: number): number => 2 * Math.ceil(size / 2);

export class Picture {
  readonly canvas = document.createElement('canvas');
  /** Pixels of the picture to each of the page. */
  readonly scale: number;
  private readonly context: CanvasRenderingContext2D;
  private readonly size: DOMRect;

  /**
   * @param stage the view and what lies over it.
   * @param plots the list of plots; null for a picture without them.
   */
  constructor(
    private readonly stage: HTMLElement,
    private readonly plots: HTMLElement | null,
  ) {
    this.size = stage.getBoundingClientRect();
    this.scale = Math.min(2, Math.max(1, window.devicePixelRatio, LEAST_WIDTH / this.size.width));
    const below = plots ? plots.clientHeight * (this.size.width / plots.clientWidth) : 0;
    this.canvas.width = even(this.size.width * this.scale);
    this.canvas.height = even((this.size.height + below) * this.scale);
    const context = this.canvas.getContext('2d', { alpha: false });
    if (!context) throw new Error('The browser has no 2D canvas.');
    this.context = context;
  }

  /** Draws what is seen now; `title` stands over it. The view must have been drawn since the browser showed it last. */
  draw(title: string): void {
    const { context, canvas, stage, plots, scale, size } = this;
    const { background, color, font } = styleOf(document.body);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = background;
    context.fillRect(0, 0, canvas.width, canvas.height);
    // A window that has become another size meanwhile is fitted in.
    const box = stage.getBoundingClientRect();
    const fit = scale * Math.min(size.width / box.width, size.height / box.height);
    context.setTransform(fit, 0, 0, fit, -box.left * fit, -box.top * fit);
    this.drawPart(stage);
    context.font = font.replace(/^\S+/, '600');
    context.fillStyle = color;
    context.textBaseline = 'top';
    context.fillText(title, box.left + 10, box.top + 10);
    if (!plots) return;
    const list = plots.getBoundingClientRect();
    const across = (scale * size.width) / plots.clientWidth;
    context.setTransform(across, 0, 0, across, -list.left * across, size.height * scale - list.top * across);
    context.save();
    context.beginPath();
    context.rect(list.left, list.top, plots.clientWidth, plots.clientHeight);
    context.clip();
    this.drawPart(plots);
    context.restore();
  }

  /** Draws canvases, symbols and texts within an element, each where it is on the page. */
  private drawPart(part: HTMLElement): void {
    for (const shown of part.querySelectorAll<HTMLElement | SVGSVGElement>(
      'canvas, .compass, .scale, .name-tag, .swatch, .roles-legend > span, .stroke, .entry > .name, .entry > .value',
    )) {
      const box = shown.getBoundingClientRect();
      if (!box.width || !box.height) continue;
      if (shown instanceof HTMLCanvasElement) this.context.drawImage(shown, box.left, box.top, box.width, box.height);
      else if (shown instanceof SVGSVGElement) this.drawCompass(shown, box);
      else if (shown.matches('.swatch, .stroke')) this.drawMark(shown, box);
      else this.drawText(shown, box);
    }
  }

  private drawText(shown: HTMLElement, box: DOMRect): void {
    const { context } = this;
    const { background, color, font, padding } = styleOf(shown);
    context.fillStyle = background;
    context.fillRect(box.left, box.top, box.width, box.height);
    context.font = font;
    context.fillStyle = color;
    context.textBaseline = 'middle';
    // A swatch before the text leaves it less room.
    const before = shown.querySelector('.swatch') ? 15 : 0;
    const lines = this.broken(shown.textContent, box.width - padding - before + 1);
    const height = box.height / lines.length;
    // A legend scrolls where it has no room, and what is out of sight stays so.
    const sight = shown.closest('.legend')?.getBoundingClientRect() ?? box;
    context.save();
    context.beginPath();
    context.rect(sight.left, sight.top, sight.width, sight.height);
    context.clip();
    lines.forEach((line, i) => context.fillText(line, box.left + padding + before, box.top + (i + 0.5) * height));
    context.restore();
  }

  /** A text in lines of at most that width, broken between words, as the page breaks it. */
  private broken(text: string, width: number): string[] {
    const lines: string[] = [];
    for (const word of text.split(' ')) {
      const longer = lines.length ? `${lines[lines.length - 1]} ${word}` : word;
      if (lines.length && this.context.measureText(longer).width <= width) lines[lines.length - 1] = longer;
      else lines.push(word);
    }
    return lines;
  }

  /** A square of a colour, or the stroke of a line, which may be dashed. */
  private drawMark(shown: HTMLElement, box: DOMRect): void {
    const { context } = this;
    const { background, color } = styleOf(shown);
    if (shown.matches('.swatch')) {
      context.fillStyle = background;
      context.fillRect(box.left, box.top, box.width, box.height);
      return;
    }
    context.strokeStyle = color;
    context.lineWidth = box.height;
    context.setLineDash(shown.matches('.dashed') ? [4, 3] : []);
    context.beginPath();
    context.moveTo(box.left, box.top + box.height / 2);
    context.lineTo(box.right, box.top + box.height / 2);
    context.stroke();
    context.setLineDash([]);
  }

  private drawCompass(shown: SVGSVGElement, box: DOMRect): void {
    const { context } = this;
    const { width, x } = shown.viewBox.baseVal;
    context.save();
    context.translate(box.left, box.top);
    context.scale(box.width / width, box.width / width);
    context.translate(-x, -x);
    const number = (part: Element, name: string): number => Number(part.getAttribute(name) ?? 0);
    context.lineWidth = 2;
    context.lineCap = 'round';
    for (const line of shown.querySelectorAll('line')) {
      context.strokeStyle = line.getAttribute('stroke') ?? '';
      context.beginPath();
      context.moveTo(0, 0);
      context.lineTo(number(line, 'x2'), number(line, 'y2'));
      context.stroke();
    }
    context.textAlign = 'center';
    context.textBaseline = 'alphabetic';
    for (const text of shown.querySelectorAll('text')) {
      context.font = styleOf(text).font;
      context.fillStyle = text.getAttribute('fill') ?? '';
      context.fillText(text.textContent, number(text, 'x'), number(text, 'y'));
    }
    context.restore();
  }
}

/** What of an element's style a canvas can do; `padding` is that at its left, CSS pixels. */
function styleOf(shown: Element): { background: string; color: string; font: string; padding: number } {
  const style = getComputedStyle(shown);
  return {
    background: style.backgroundColor,
    color: style.color,
    font: `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`,
    padding: parseFloat(style.paddingLeft),
  };
}
