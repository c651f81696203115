/**
 * Links that look alike but for their colour and place, drawn in one go: a robot of 500 modules has 1,500 links of three
 * shapes. What is out of sight is left out, for without a graphics processor it takes as long as what is seen.
 */

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  Frustum,
  Group,
  InstancedMesh,
  Matrix4,
  type PerspectiveCamera,
  Sphere,
  SRGBColorSpace,
  Vector3,
} from 'three';
import type { Shape } from '../model/run_data.ts';
import { addEdges, LinkMaterial } from './link_material.ts';
import { boxOf, fewFacesOf, SmallLinks } from './small_links.ts';

/** A link less wide than so many pixels of the page is drawn with few faces, and as a box. */
const SMALL = 30;
const TINY = 10;

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

/** Links of one shape. */
interface Batch {
  shape: Shape | undefined;
  geometry: BufferGeometry;
  /** Corners of the few faces that it has where it is small, and of its box; empty if it is drawn as it is. */
  small: Float32Array;
  tiny: Float32Array;
  /** The mean of the colours of its own, and how much of its surface has them. */
  own: Color;
  ownShare: number;
  /** What it fills about the origin of its link, metres. */
  radius: number;
  /** How many links have the shape, and how many of them are drawn as they are. */
  links: number;
  count: number;
  mesh: InstancedMesh<BufferGeometry, LinkMaterial> | null;
}

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
export function shapeGeometry(shape: Shape | undefined): BufferGeometry {
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
  private readonly smallLinks = new SmallLinks();
  private readonly sphere = new Sphere();
  private readonly mixed = new Color();

  constructor() {
    this.group.add(this.smallLinks.mesh);
  }

  /** The geometry for one more link of a shape, which all links of that shape have in common. */
  geometryOf(shape: Shape | undefined): BufferGeometry {
    let batch = this.batches.find((known) => alike(known.shape, shape));
    if (!batch) {
      batch = makeBatch(shape);
      this.batches.push(batch);
      this.byGeometry.set(batch.geometry, batch);
    }
    batch.links++;
    return batch.geometry;
  }

  /** Begins a picture: what is drawn of it is added next. */
  begin(): void {
    this.smallLinks.begin();
    for (const batch of this.batches) {
      batch.count = 0;
      if ((batch.mesh?.instanceMatrix.count ?? 0) < batch.links) this.makeRoom(batch);
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
    const corners = pixels < TINY ? batch.tiny : batch.small;
    if (pixels < SMALL && corners.length) {
      return this.smallLinks.add(corners, place, this.mixed.copy(colour).lerp(batch.own, batch.ownShare));
    }
    batch.mesh?.setMatrixAt(batch.count, place);
    batch.mesh?.setColorAt(batch.count, colour);
    batch.count++;
  }

  /** Ends a picture. */
  end(): void {
    this.smallLinks.end();
    for (const { mesh, count } of this.batches) {
      if (!mesh) continue;
      mesh.count = count;
      mesh.visible = count > 0;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  dispose(): void {
    this.smallLinks.dispose();
    for (const { geometry, mesh } of this.batches) {
      geometry.dispose();
      mesh?.material.dispose();
      mesh?.dispose();
    }
  }

  private makeRoom(batch: Batch): void {
    const before = batch.mesh;
    batch.mesh = new InstancedMesh(batch.geometry, before?.material ?? new LinkMaterial(), batch.links);
    // Each of its links is asked whether it is in sight.
    batch.mesh.frustumCulled = false;
    this.group.add(batch.mesh);
    if (!before) return;
    this.group.remove(before);
    before.dispose();
  }
}

function makeBatch(shape: Shape | undefined): Batch {
  const geometry = shapeGeometry(shape);
  geometry.computeBoundingSphere();
  const { center, radius } = geometry.boundingSphere ?? new Sphere();
  // A link without a shape is a box already.
  const small = shape ? fewFacesOf(geometry) : new Float32Array(0);
  const tiny = shape ? boxOf(geometry) : small;
  const [own, ownShare] = ownColourOf(geometry);
  return { shape, geometry, small, tiny, own, ownShare, radius: center.length() + radius, links: 0, count: 0, mesh: null };
}

/** The mean of a geometry's own colours by area (linear values, as light is added up), and the share of the area that has one. */
function ownColourOf(geometry: BufferGeometry): [Color, number] {
  const position = geometry.getAttribute('position');
  const ownColour = geometry.getAttribute('ownColour');
  const sum = new Color(0, 0, 0);
  let own = 0;
  let all = 0;
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  for (let i = 0; i < position.count; i += 3) {
    [a, b, c].forEach((corner, k) => corner.fromBufferAttribute(position, i + k));
    const area = b.sub(a).cross(c.sub(a)).length();
    all += area;
    if (!ownColour.getW(i)) continue;
    own += area;
    const colour = new Color().setRGB(ownColour.getX(i), ownColour.getY(i), ownColour.getZ(i), SRGBColorSpace);
    sum.add(colour.multiplyScalar(area));
  }
  return [own ? sum.multiplyScalar(1 / own) : sum, all ? own / all : 0];
}
