/**
 * Links that are small in the picture, all of them as one mesh of few faces each. Where there is no graphics processor an
 * instance takes 25 microseconds, whatever its size, and a corner a fifth of one: 1,500 links in one mesh take half the time.
 */

import {
  Box3,
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Mesh,
  MeshLambertMaterial,
  Vector3,
  type Color,
  type Matrix4,
} from 'three';
import { ConvexGeometry } from 'three/addons/geometries/ConvexGeometry.js';

/** The axes and the corners of a cube. */
const DIRECTIONS = [-1, 0, 1]
  .flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => new Vector3(x, y, z))))
  .filter((direction) => [1, 3].includes(direction.lengthSq()));

/**
 * The corners of at most 24 triangles around a body: of the hull of those of its corners that lie farthest in 14 directions.
 * Empty if it is flat.
 */
export function fewFacesOf(geometry: BufferGeometry): Float32Array {
  const position = geometry.getAttribute('position');
  const farthest = new Map<number, Vector3>();
  for (const direction of DIRECTIONS) {
    let best = 0;
    let most = -Infinity;
    for (let i = 0; i < position.count; i++) {
      const reach = direction.x * position.getX(i) + direction.y * position.getY(i) + direction.z * position.getZ(i);
      if (reach > most + 1e-9) [best, most] = [i, reach];
    }
    farthest.set(best, new Vector3().fromBufferAttribute(position, best));
  }
  return new ConvexGeometry([...farthest.values()]).getAttribute('position').array as Float32Array;
}

/** The corners of the twelve triangles of the box that a body fills. */
export function boxOf(geometry: BufferGeometry): Float32Array {
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox ?? new Box3();
  const size = max.clone().sub(min);
  const box = new BoxGeometry(size.x, size.y, size.z).translate(...min.clone().addScaledVector(size, 0.5).toArray());
  return box.toNonIndexed().getAttribute('position').array as Float32Array;
}

export class SmallLinks {
  readonly mesh = new Mesh(new BufferGeometry(), new MeshLambertMaterial({ vertexColors: true, flatShading: true }));
  private positions = new Float32Array(0);
  private colours = new Float32Array(0);
  /** Numbers that are in use, three a corner. */
  private used = 0;

  constructor() {
    // They are asked one by one whether they are in sight.
    this.mesh.frustumCulled = false;
  }

  begin(): void {
    this.used = 0;
  }

  /** Adds a body with these corners, turned and moved by `place`. */
  add(corners: Float32Array, place: Matrix4, colour: Color): void {
    if (this.used + corners.length > this.positions.length) this.makeRoom(2 * (this.used + corners.length));
    const e = place.elements;
    const { positions, colours } = this;
    let at = this.used;
    for (let i = 0; i < corners.length; i += 3) {
      const x = corners[i];
      const y = corners[i + 1];
      const z = corners[i + 2];
      positions[at] = e[0] * x + e[4] * y + e[8] * z + e[12];
      colours[at++] = colour.r;
      positions[at] = e[1] * x + e[5] * y + e[9] * z + e[13];
      colours[at++] = colour.g;
      positions[at] = e[2] * x + e[6] * y + e[10] * z + e[14];
      colours[at++] = colour.b;
    }
    this.used = at;
  }

  end(): void {
    const { geometry } = this.mesh;
    geometry.setDrawRange(0, this.used / 3);
    this.mesh.visible = this.used > 0;
    if (!this.used) return;
    for (const name of ['position', 'color']) {
      const attribute = geometry.getAttribute(name) as BufferAttribute;
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, this.used);
      attribute.needsUpdate = true;
    }
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private makeRoom(numbers: number): void {
    const larger = (old: Float32Array): Float32Array<ArrayBuffer> => {
      const array = new Float32Array(numbers);
      array.set(old);
      return array;
    };
    this.positions = larger(this.positions);
    this.colours = larger(this.colours);
    this.mesh.geometry.dispose();
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.positions, 3).setUsage(DynamicDrawUsage));
    geometry.setAttribute('color', new BufferAttribute(this.colours, 3).setUsage(DynamicDrawUsage));
    this.mesh.geometry = geometry;
  }
}
