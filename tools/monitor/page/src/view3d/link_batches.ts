/**
 * Links that look alike but for their colour and place, drawn in one go: a robot of 500 modules has 1,500 links of three
 * shapes. What is out of sight is left out, and what is small has few faces: drawn by software, a thousand triangles take
 * half a millisecond, seen or not.
 */

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Frustum,
  Group,
  InstancedMesh,
  Matrix4,
  type PerspectiveCamera,
  Sphere,
  Vector3,
  type Color,
} from 'three';
import { ConvexGeometry } from 'three/addons/geometries/ConvexGeometry.js';
import type { Shape } from '../model/run_data.ts';
import { addEdges, LinkMaterial } from './link_material.ts';

/** A link less wide than so many pixels of the page is drawn with few faces. */
const SMALL = 30;
/** Those of a body with more triangles than this are worth being left out. */
const MANY_CORNERS = 3 * 40;

/** From where the robot is seen, in the frame of its group. */
export interface Sight {
  frustum: Frustum;
  eye: Vector3;
  /** How many pixels of the page a metre at a distance of a metre takes. */
  pixels: number;
}

/** Sight of what stands in a group at `place`. */
export function sightOf(camera: PerspectiveCamera, height: number, place: Vector3): Sight {
  camera.updateMatrixWorld();
  const group = new Matrix4().makeTranslation(place);
  const projection = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(group);
  return {
    frustum: new Frustum().setFromProjectionMatrix(projection),
    eye: camera.position.clone().sub(place),
    pixels: height / (2 * Math.tan((camera.fov * Math.PI) / 360)),
  };
}

/** Instances of one geometry. */
interface Instances {
  geometry: BufferGeometry;
  mesh: InstancedMesh<BufferGeometry, LinkMaterial> | null;
  count: number;
}

/** Links of one shape. */
interface Batch {
  shape: Shape | undefined;
  /** How many links have the shape. */
  links: number;
  /** As it is, and with few faces; null where it has few. */
  fine: Instances;
  coarse: Instances | null;
  /** What it fills about the origin of its link, metres. */
  radius: number;
}

/** A body with at most 24 faces around another one: the hull of its corners that lie farthest in 14 directions. */
function coarseOf(geometry: BufferGeometry): BufferGeometry {
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
  const coarse = new ConvexGeometry([...farthest.values()]);
  coarse.deleteAttribute('uv');
  return withEdges(coarse);
}

/** The axes and the corners of a cube. */
const DIRECTIONS = [-1, 0, 1]
  .flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => new Vector3(x, y, z))))
  .filter((d) => [1, 3].includes(d.lengthSq()));

/** With what a LinkMaterial wants. */
function withEdges(geometry: BufferGeometry): BufferGeometry {
  addEdges(geometry);
  if (!geometry.hasAttribute('ownColour')) {
    const none = new Float32Array(geometry.getAttribute('position').count * 4);
    geometry.setAttribute('ownColour', new BufferAttribute(none, 4));
  }
  return geometry;
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
  return withEdges(geometry);
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
  private readonly sphere = new Sphere();

  /** The geometry for one more link of a shape, which all links of that shape have in common. */
  geometryOf(shape: Shape | undefined): BufferGeometry {
    let batch = this.batches.find((known) => alike(known.shape, shape));
    if (!batch) {
      batch = makeBatch(shape);
      this.batches.push(batch);
      this.byGeometry.set(batch.fine.geometry, batch);
    }
    batch.links++;
    return batch.fine.geometry;
  }

  /** Begins a picture: what is drawn of it is added next. */
  begin(): void {
    for (const batch of this.batches) {
      for (const instances of [batch.fine, batch.coarse]) {
        if (!instances) continue;
        instances.count = 0;
        if ((instances.mesh?.instanceMatrix.count ?? 0) < batch.links) this.makeRoom(instances, batch.links);
      }
    }
  }

  /** Draws a link with one of these geometries at a place of the group, if it is seen from there. */
  add(geometry: BufferGeometry, place: Matrix4, colour: Color, sight: Sight): void {
    const batch = this.byGeometry.get(geometry);
    if (!batch) return;
    this.sphere.center.setFromMatrixPosition(place);
    this.sphere.radius = batch.radius;
    if (!sight.frustum.intersectsSphere(this.sphere)) return;
    const pixels = (2 * batch.radius * sight.pixels) / this.sphere.center.distanceTo(sight.eye);
    const instances = batch.coarse && pixels < SMALL ? batch.coarse : batch.fine;
    instances.mesh?.setMatrixAt(instances.count, place);
    instances.mesh?.setColorAt(instances.count, colour);
    instances.count++;
  }

  /** Ends a picture. */
  end(): void {
    for (const { mesh, count } of this.instances()) {
      if (!mesh) continue;
      mesh.count = count;
      mesh.visible = count > 0;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  dispose(): void {
    for (const { geometry, mesh } of this.instances()) {
      geometry.dispose();
      mesh?.material.dispose();
      mesh?.dispose();
    }
  }

  private instances(): Instances[] {
    return this.batches.flatMap(({ fine, coarse }) => (coarse ? [fine, coarse] : [fine]));
  }

  private makeRoom(instances: Instances, links: number): void {
    const before = instances.mesh;
    instances.mesh = new InstancedMesh(instances.geometry, before?.material ?? new LinkMaterial(), links);
    // Each of its links is asked whether it is in sight.
    instances.mesh.frustumCulled = false;
    this.group.add(instances.mesh);
    if (!before) return;
    this.group.remove(before);
    before.dispose();
  }
}

function makeBatch(shape: Shape | undefined): Batch {
  const geometry = geometryOf(shape);
  geometry.computeBoundingSphere();
  const { center, radius } = geometry.boundingSphere ?? new Sphere();
  const coarse = geometry.getAttribute('position').count > MANY_CORNERS ? coarseOf(geometry) : null;
  return {
    shape,
    links: 0,
    fine: { geometry, mesh: null, count: 0 },
    // What is flat has no hull.
    coarse: coarse?.getAttribute('position').count ? { geometry: coarse, mesh: null, count: 0 } : null,
    radius: center.length() + radius,
  };
}
