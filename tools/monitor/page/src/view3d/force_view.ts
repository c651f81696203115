/** Forces on the links of one robot as arrows: of the ground and of obstacles, and of who pushes. */

import { Group, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3, type BufferGeometry } from 'three';
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

/** The arrows of one colour, drawn in one go: a robot of hundreds of modules stands on as many. */
class Arrows {
  mesh: InstancedMesh<BufferGeometry, MeshBasicMaterial>;

  constructor(
    private readonly group: Group,
    geometry: BufferGeometry,
    color: string,
  ) {
    const material = new MeshBasicMaterial({ color, depthTest: false, transparent: true, opacity: 0.85 });
    this.mesh = this.withRoom(geometry, material, 16);
  }

  /** Draws these, and no others. */
  show(places: Matrix4[]): void {
    const { geometry, material, instanceMatrix } = this.mesh;
    if (instanceMatrix.count < places.length) {
      this.group.remove(this.mesh);
      this.mesh.dispose();
      this.mesh = this.withRoom(geometry, material, 2 * places.length);
    }
    places.forEach((place, i) => this.mesh.setMatrixAt(i, place));
    this.mesh.count = places.length;
    this.mesh.visible = places.length > 0;
    this.mesh.instanceMatrix.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.dispose();
    this.mesh.material.dispose();
  }

  private withRoom(
    geometry: BufferGeometry,
    material: MeshBasicMaterial,
    count: number,
  ): InstancedMesh<BufferGeometry, MeshBasicMaterial> {
    const mesh = new InstancedMesh(geometry, material, count);
    // The arrows go where the robot goes.
    mesh.frustumCulled = false;
    mesh.renderOrder = 3;
    this.group.add(mesh);
    return mesh;
  }
}

export class ForceView {
  readonly group = new Group();
  private readonly geometry: BufferGeometry = arrowGeometry();
  private readonly arrows = Object.entries(FORCE_COLOURS).map(
    ([table, color]) => [table, new Arrows(this.group, this.geometry, color)] as const,
  );

  /** Shows what pushed at `time`. `placeOf` is where a link is drawn; null if nowhere. */
  show(run: Run, time: number, visible: boolean, placeOf: (link: string) => Vector3 | null): void {
    for (const [table, arrows] of this.arrows) {
      const places: Matrix4[] = [];
      for (const { link, force } of visible ? run.forcesAt(table, time) : []) {
        const place = placeOf(link);
        const vector = new Vector3(...force);
        if (place && vector.length() > LEAST) places.push(arrowAt(place, vector));
      }
      arrows.show(places);
    }
  }

  dispose(): void {
    this.geometry.dispose();
    for (const [, arrows] of this.arrows) arrows.dispose();
  }
}

/** Places an arrow of length 1 and radius 1 along +y so that it shows a force, newtons. */
function arrowAt(place: Vector3, force: Vector3): Matrix4 {
  const length = Math.min(LONGEST, force.length() * METRES_PER_NEWTON);
  const turn = new Quaternion().setFromUnitVectors(UP, force.clone().normalize());
  return new Matrix4().compose(place, turn, new Vector3(THICKNESS, length, THICKNESS));
}
