/** What links are drawn with: flat faces with dark edges, in one go. */

import { BufferAttribute, Vector3, type BufferGeometry, MeshLambertMaterial } from 'three';

/** Edges between faces that turn by less than this are not drawn: they are inside a curved surface. */
const SHARP = Math.cos((20 * Math.PI) / 180);

/** How bright an edge is compared to the face; of a module that is selected it shines. */
const EDGE = 0.55;
const SELECTED_EDGE = 1.6;

/**
 * A material whose edges are drawn by the fragment's distance to them; the geometry needs addEdges(), and `ownColour`:
 * a colour of the point that counts instead of the material's (sRGB and 1), or zeros.
 */
export class LinkMaterial extends MeshLambertMaterial {
  private readonly edgeShade = { value: EDGE };

  constructor() {
    super();
    this.onBeforeCompile = (shader) => {
      shader.uniforms.edgeShade = this.edgeShade;
      shader.vertexShader = shader.vertexShader
        .replace(
          '#include <common>',
          'attribute vec3 edge;\nattribute vec4 ownColour;\nvarying vec3 vEdge;\nvarying vec4 vOwn;\n#include <common>',
        )
        .replace('#include <begin_vertex>', '#include <begin_vertex>\nvEdge = edge;\nvOwn = ownColour;');
      shader.fragmentShader = shader.fragmentShader
        .replace(
          '#include <common>',
          'uniform float edgeShade;\nvarying vec3 vEdge;\nvarying vec4 vOwn;\n#include <common>',
        )
        .replace(
          '#include <color_fragment>',
          // Colours come as sRGB, and light is added up in linear values.
          '#include <color_fragment>\ndiffuseColor.rgb = mix(diffuseColor.rgb, pow(vOwn.rgb, vec3(2.2)), vOwn.a);',
        )
        .replace(
          '#include <opaque_fragment>',
          `#include <opaque_fragment>
vec3 pixels = vEdge / max(fwidth(vEdge), vec3(1e-6));
gl_FragColor.rgb *= mix(edgeShade, 1.0, smoothstep(0.3, 1.5, min(min(pixels.x, pixels.y), pixels.z)));`,
        );
    };
  }

  setSelected(selected: boolean): void {
    this.edgeShade.value = selected ? SELECTED_EDGE : EDGE;
  }
}

/**
 * Adds the attribute `edge` to a geometry whose triangles have corners of their own: at each corner the distance to the
 * three sides of its triangle, in heights of the triangle; to sides that are no edge of the body it is always one.
 */
export function addEdges(geometry: BufferGeometry): void {
  const position = geometry.getAttribute('position');
  const corner = (i: number): Vector3 => new Vector3().fromBufferAttribute(position as BufferAttribute, i);
  // Sides are known by their ends, rounded to micrometres, and remember the normal of the first triangle.
  const key = (v: Vector3): string => v.toArray().map((c) => Math.round(c * 1e6)).join();
  const sides = new Map<string, { normal: Vector3; sharp: boolean }>();
  const sideOf = (a: Vector3, b: Vector3): string => [key(a), key(b)].sort().join(';');
  const triangles: { sides: string[] }[] = [];
  for (let i = 0; i < position.count; i += 3) {
    const [a, b, c] = [corner(i), corner(i + 1), corner(i + 2)];
    const normal = b.clone().sub(a).cross(c.clone().sub(a)).normalize();
    // Each side lies opposite to the corner of the same number.
    const own = [sideOf(b, c), sideOf(c, a), sideOf(a, b)];
    for (const side of own) {
      const known = sides.get(side);
      // A side that only one triangle has is an edge as well.
      if (!known) sides.set(side, { normal, sharp: true });
      else known.sharp = known.normal.dot(normal) < SHARP;
    }
    triangles.push({ sides: own });
  }
  const edge = new Float32Array(position.count * 3);
  triangles.forEach((triangle, t) => {
    triangle.sides.forEach((side, s) => {
      const sharp = sides.get(side)?.sharp ?? true;
      for (let v = 0; v < 3; v++) edge[(3 * t + v) * 3 + s] = !sharp || v === s ? 1 : 0;
    });
  });
  geometry.setAttribute('edge', new BufferAttribute(edge, 3));
}
