/** Forces on the links of one robot as arrows: of the ground and of obstacles, and of who pushes. */

import { Group, Mesh, MeshBasicMaterial, Quaternion, Vector3, type BufferGeometry } from 'three';
import type { Run } from '../model/run.ts';
import { FORCE_COLOURS } from './palette.ts';
import { arrowGeometry } from './solids.ts';

/** Metres of an arrow a newton, and how long one gets at most. */
export const METRES_PER_NEWTON = 0.01;
const LONGEST = 0.3;
const THICKNESS = 0.0035;
/** Less is noise of the contact solver, newtons. */
const LEAST = 0.05;
const UP = new Vector3(0, 1, 0);

export class ForceView {
  readonly group = new Group();
  private readonly geometry: BufferGeometry = arrowGeometry();
  private readonly materials = new Map(
    Object.entries(FORCE_COLOURS).map(([table, color]) => [
      table,
      new MeshBasicMaterial({ color, depthTest: false, transparent: true, opacity: 0.85 }),
    ]),
  );
  private arrows: Mesh[] = [];

  /** Shows what pushed at `time`. `placeOf` is where a link is drawn; null if nowhere. */
  show(run: Run, time: number, visible: boolean, placeOf: (link: string) => Vector3 | null): void {
    let used = 0;
    if (visible) {
      for (const [table, material] of this.materials) {
        for (const { link, force } of run.forcesAt(table, time)) {
          const place = placeOf(link);
          const vector = new Vector3(...force);
          if (place && vector.length() > LEAST) this.place(used++, material, place, vector);
        }
      }
    }
    this.arrows.forEach((arrow, i) => (arrow.visible = i < used));
  }

  dispose(): void {
    this.geometry.dispose();
    for (const material of this.materials.values()) material.dispose();
  }

  private place(i: number, material: MeshBasicMaterial, place: Vector3, force: Vector3): void {
    if (!this.arrows[i]) {
      this.arrows[i] = new Mesh(this.geometry, material);
      this.arrows[i].renderOrder = 3;
      this.group.add(this.arrows[i]);
    }
    const arrow = this.arrows[i];
    const length = Math.min(LONGEST, force.length() * METRES_PER_NEWTON);
    arrow.material = material;
    arrow.position.copy(place);
    arrow.scale.set(THICKNESS, length, THICKNESS);
    arrow.quaternion.copy(new Quaternion().setFromUnitVectors(UP, force.normalize()));
  }
}
