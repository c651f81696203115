/** The ground: a plane with lines that fades into the sky. One shader draws all of it, which is cheap in software, too. */

import { Color, Mesh, PlaneGeometry, ShaderMaterial, Vector3 } from 'three';

/** Colours of the ground in a theme, as CSS writes them. */
export interface GroundTheme {
  sky: string;
  ground: string;
  fine: string;
  coarse: string;
}

/** Distances of lines, metres. */
const FINE = 0.1;
const COARSE = 0.5;
/** Between these distances from the camera the ground fades, metres. */
const FADE_FROM = 2.2;
const FADE_TO = 5;

const VERTEX = `
varying vec2 place;
varying float depth;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  vec4 seen = viewMatrix * world;
  place = world.xz;
  depth = -seen.z;
  gl_Position = projectionMatrix * seen;
}`;

// A line is as wide as a pixel of the page at every distance, in which there are so many drawn pixels; where several lines fall
// into one, they fade.
const FRAGMENT = `
uniform vec3 sky, ground, fine, coarse;
uniform float pixelRatio;
varying vec2 place;
varying float depth;
float lines(float step) {
  vec2 p = place / step;
  vec2 pixel = fwidth(p) * pixelRatio;
  vec2 nearness = clamp(1.0 - abs(fract(p - 0.5) - 0.5) / pixel, 0.0, 1.0);
  vec2 strength = nearness * clamp(1.0 - 2.0 * pixel, 0.0, 1.0);
  return max(strength.x, strength.y);
}
void main() {
  vec3 colour = mix(ground, fine, lines(${FINE.toFixed(2)}));
  colour = mix(colour, coarse, lines(${COARSE.toFixed(2)}));
  gl_FragColor = vec4(mix(colour, sky, smoothstep(${FADE_FROM.toFixed(1)}, ${FADE_TO.toFixed(1)}, depth)), 1.0);
}`;

/** A colour as it is written to the screen, without conversion. */
function screenColour(text: string): Vector3 {
  const { r, g, b } = new Color(text).convertLinearToSRGB();
  return new Vector3(r, g, b);
}

export class Ground {
  readonly mesh: Mesh<PlaneGeometry, ShaderMaterial>;

  constructor() {
    const colour = (): { value: Vector3 } => ({ value: new Vector3() });
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { sky: colour(), ground: colour(), fine: colour(), coarse: colour(), pixelRatio: { value: 1 } },
    });
    this.mesh = new Mesh(new PlaneGeometry(30, 30), material);
    this.mesh.rotation.x = -Math.PI / 2;
    this.mesh.position.y = -0.001;
  }

  setTheme(theme: GroundTheme): void {
    const { uniforms } = this.mesh.material;
    for (const name of ['sky', 'ground', 'fine', 'coarse'] as const) uniforms[name].value = screenColour(theme[name]);
  }

  /** How many pixels are drawn in the width of one of the page. */
  setPixelRatio(ratio: number): void {
    // No line is thinner than what is drawn.
    this.mesh.material.uniforms.pixelRatio.value = Math.max(1, ratio);
  }

  /** Lies under this place of the world; its lines stay where they are. */
  moveTo(x: number, z: number): void {
    this.mesh.position.x = x;
    this.mesh.position.z = z;
  }
}
