/** Solids that are drawn over robots: the axes of a frame, and an arrow. Lines of one pixel cannot be told apart. */

import { BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, Matrix4, Vector3 } from 'three';
import { mergeGeometries } from 'three/addons/utils/BufferGeometryUtils.js';
import { AXIS_COLOURS } from './palette.ts';

/** Corners around a shaft or a tip. */
const SIDES = 10;
/** An axis or arrow of length 1 has a tip of this length; radii are in the unit of the thickness. */
const TIP = 0.28;

/** Along +y from the origin: a shaft of radius 1 and a tip of radius 2.4, `thickness` times as wide as it is long. */
function arrow(thickness: number): BufferGeometry {
  const shaft = new CylinderGeometry(thickness, thickness, 1 - TIP, SIDES);
  shaft.translate(0, (1 - TIP) / 2, 0);
  const tip = new ConeGeometry(2.4 * thickness, TIP, SIDES);
  tip.translate(0, 1 - TIP / 2, 0);
  return mergeGeometries([shaft, tip]);
}

/** An arrow of length 1 and radius 1 along +y: to be scaled by its thickness and length. */
export function arrowGeometry(): BufferGeometry {
  return arrow(1);
}

/** The axes of a frame, each of length 1: x red, y green, z blue. */
export function axesGeometry(): BufferGeometry {
  const turns = [new Matrix4().makeRotationZ(-Math.PI / 2), new Matrix4(), new Matrix4().makeRotationX(Math.PI / 2)];
  return mergeGeometries(
    turns.map((turn, i) => {
      const axis = arrow(0.045).applyMatrix4(turn);
      const { r, g, b } = new Color(AXIS_COLOURS[i]);
      const colours = Array.from({ length: axis.attributes.position.count }, () => [r, g, b]).flat();
      return axis.setAttribute('color', new BufferAttribute(new Float32Array(colours), 3));
    }),
  );
}

/** How far an outline stands off from its link, metres. */
const OUTLINE = 0.0025;

/** A solid a little larger than a link's: seen from behind, only what stands out of the link remains of it. */
export function outlineOf(link: BufferGeometry): BufferGeometry {
  link.computeBoundingBox();
  const centre = link.boundingBox?.getCenter(new Vector3()) ?? new Vector3();
  const position = link.getAttribute('position');
  const points = new Float32Array(position.count * 3);
  const corner = new Vector3();
  for (let i = 0; i < position.count; i++) {
    corner.fromBufferAttribute(position, i);
    // Hulls are convex: away from the middle is outward.
    const outward = corner.clone().sub(centre).normalize();
    corner.addScaledVector(outward, OUTLINE * Math.SQRT2).toArray(points, 3 * i);
  }
  return new BufferGeometry().setAttribute('position', new BufferAttribute(points, 3));
}
