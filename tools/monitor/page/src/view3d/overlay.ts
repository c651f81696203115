/** Text over the 3D view: the directions of the world, the grid's scale, names of modules. */

import { Vector3, type PerspectiveCamera } from 'three';
import { element, setText } from '../ui/dom.ts';
import { AXIS_COLOURS } from './palette.ts';

/** The axes of the world: x north, y up, z east; the colours are those of frames. */
const DIRECTIONS = [
  { name: 'N', axis: new Vector3(1, 0, 0), colour: AXIS_COLOURS[0] },
  { name: 'Up', axis: new Vector3(0, 1, 0), colour: AXIS_COLOURS[1] },
  { name: 'E', axis: new Vector3(0, 0, 1), colour: AXIS_COLOURS[2] },
];

export class ViewOverlay {
  private readonly layer = element('div', { class: 'view-overlay', 'aria-hidden': 'true' });
  private readonly compass: SVGSVGElement;
  private readonly names: HTMLElement[] = [];
  private shownCompass = '';
  private width = 1;
  private height = 1;

  constructor(container: HTMLElement) {
    this.compass = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    this.compass.setAttribute('class', 'compass');
    this.compass.setAttribute('viewBox', '-40 -40 80 80');
    this.layer.append(this.compass, element('div', { class: 'scale' }, 'grid 10 cm'));
    container.append(this.layer);
  }

  resize(width: number, height: number): void {
    this.width = width;
    this.height = height;
  }

  draw(camera: PerspectiveCamera, names: readonly { text: string; place: Vector3; kind: string }[]): void {
    this.drawCompass(camera);
    while (this.names.length < names.length) {
      const label = element('span');
      this.names.push(label);
      this.layer.append(label);
    }
    this.names.forEach((label, i) => {
      const name = names[i];
      const p = name ? name.place.clone().project(camera) : null;
      label.hidden = !p || p.z > 1;
      if (!p || !name) return;
      setText(label, name.text);
      label.className = `name-tag ${name.kind}`;
      label.style.transform = `translate(${((p.x + 1) / 2) * this.width}px, ${((1 - p.y) / 2) * this.height}px) translate(-50%, -50%)`;
    });
  }

  private drawCompass(camera: PerspectiveCamera): void {
    const lines = DIRECTIONS.map(({ name, axis, colour }) => {
      const v = axis.clone().transformDirection(camera.matrixWorldInverse);
      const x = (v.x * 24).toFixed(1);
      const y = (-v.y * 24).toFixed(1);
      const tx = (v.x * 33).toFixed(1);
      const ty = (-v.y * 33 + 3.5).toFixed(1);
      return `<line x2="${x}" y2="${y}" stroke="${colour}"/><text x="${tx}" y="${ty}" fill="${colour}">${name}</text>`;
    });
    // It is made anew only if the camera has turned.
    const shown = lines.join('');
    if (shown === this.shownCompass) return;
    this.shownCompass = shown;
    this.compass.innerHTML = shown;
  }
}
