/** Links that look alike but for their colour and place, drawn in one go: a robot of 500 modules has 1,500 links of three shapes. */

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Group,
  InstancedMesh,
  type Color,
  type Matrix4,
} from 'three';
import type { Shape } from '../model/run_data.ts';
import { addEdges, LinkMaterial } from './link_material.ts';

/** Links of one shape. */
interface Batch {
  shape: Shape | undefined;
  geometry: BufferGeometry;
  /** How many links have the shape, and how many of them are in the picture. */
  links: number;
  count: number;
  mesh: InstancedMesh<BufferGeometry, LinkMaterial> | null;
}

/** Faces of a shape, each with corners of its own, for they are flat; a small cube where there is no shape. */
export function geometryOf(shape: Shape | undefined): BufferGeometry {
  let geometry: BufferGeometry;
  if (shape) {
    const indexed = new BufferGeometry();
    indexed.setAttribute('position', new BufferAttribute(shape.positions, 3));
    if (shape.ownColours) indexed.setAttribute('ownColour', new BufferAttribute(shape.ownColours, 4));
    if (shape.indices) indexed.setIndex(new BufferAttribute(shape.indices, 1));
    geometry = shape.indices ? indexed.toNonIndexed() : indexed;
    geometry.computeVertexNormals();
  } else {
    geometry = new BoxGeometry(0.02, 0.02, 0.02).toNonIndexed();
  }
  addEdges(geometry);
  if (!geometry.hasAttribute('ownColour')) {
    const none = new Float32Array(geometry.getAttribute('position').count * 4);
    geometry.setAttribute('ownColour', new BufferAttribute(none, 4));
  }
  return geometry;
}

function sameNumbers(a: ArrayLike<number> | null | undefined, b: ArrayLike<number> | null | undefined): boolean {
  if (!a || !b) return !a && !b;
  if (a.length !== b.length) return false;
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

function alike(a: Shape | undefined, b: Shape | undefined): boolean {
  if (!a || !b) return a === b;
  return (
    sameNumbers(a.positions, b.positions) &&
    sameNumbers(a.indices, b.indices) &&
    sameNumbers(a.ownColours, b.ownColours)
  );
}

export class LinkBatches {
  readonly group = new Group();
  private readonly batches: Batch[] = [];
  private readonly byGeometry = new Map<BufferGeometry, Batch>();

  /** The geometry for one more link of a shape, which all links of that shape have in common. */
  geometryOf(shape: Shape | undefined): BufferGeometry {
    let batch = this.batches.find((known) => alike(known.shape, shape));
    if (!batch) {
      batch = { shape, geometry: geometryOf(shape), links: 0, count: 0, mesh: null };
      this.batches.push(batch);
      this.byGeometry.set(batch.geometry, batch);
    }
    batch.links++;
    return batch.geometry;
  }

  /** Begins a picture: what is drawn of it is added next. */
  begin(): void {
    for (const batch of this.batches) {
      batch.count = 0;
      if ((batch.mesh?.instanceMatrix.count ?? 0) < batch.links) this.makeRoom(batch);
    }
  }

  /** Draws a link with one of these geometries at a place of the group. */
  add(geometry: BufferGeometry, place: Matrix4, colour: Color): void {
    const batch = this.byGeometry.get(geometry);
    if (!batch?.mesh) return;
    batch.mesh.setMatrixAt(batch.count, place);
    batch.mesh.setColorAt(batch.count, colour);
    batch.count++;
  }

  /** Ends a picture. */
  end(): void {
    for (const { mesh, count } of this.batches) {
      if (!mesh) continue;
      mesh.count = count;
      mesh.visible = count > 0;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  dispose(): void {
    for (const { geometry, mesh } of this.batches) {
      geometry.dispose();
      mesh?.material.dispose();
      mesh?.dispose();
    }
  }

  private makeRoom(batch: Batch): void {
    const before = batch.mesh;
    batch.mesh = new InstancedMesh(batch.geometry, before?.material ?? new LinkMaterial(), batch.links);
    // Its links are anywhere; which of them are in sight is not asked.
    batch.mesh.frustumCulled = false;
    this.group.add(batch.mesh);
    if (!before) return;
    this.group.remove(before);
    before.dispose();
  }
}
