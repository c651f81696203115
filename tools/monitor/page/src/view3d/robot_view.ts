/** One robot in the scene: its links with their shapes, frames, names and trails, and the obstacles of its world. */

import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  Vector3,
  type Object3D,
} from 'three';
import type { Run } from '../model/run.ts';
import { POSE_COLUMNS } from '../model/run_data.ts';
import { ForceView } from './force_view.ts';
import { fixedPoseAt } from './interpolate.ts';
import { LinkBatches, shapeGeometry, type Sight } from './link_batches.ts';
import { LinkMaterial } from './link_material.ts';
import { PROPAGATED, SELECTED } from './palette.ts';
import { axesGeometry, outlineOf } from './solids.ts';

/** Points of a trail at most, and how many seconds of sim time it goes back. */
const TRAIL_POINTS = 120;
const TRAIL_SECONDS = 6;
/** How long an axis of a frame is drawn, metres. */
const FRAME_SIZE = 0.055;

/** Of obstacles, which shall not be taken for modules. */
const OBSTACLE_COLOUR = '#8f8a84';

/** By how much a link's shape may reach beyond its origin, metres. */
const LINK_ROOM = 0.06;

/** What is drawn of the robots. */
export interface RobotOptions {
  /** Of the selected module; of all where none of the robot is. */
  frames: boolean;
  trails: boolean;
  /** Where the modules believe their links to be. */
  propagated: boolean;
  /** What pushes, as arrows. */
  forces: boolean;
  /** Drawn so that what lies behind can be seen. */
  translucent: boolean;
}

/** How a module is drawn. */
export interface ModuleLook {
  colour: string;
  /** The run goes on without it: what is left of it is there, and does nothing. */
  lost: boolean;
}

/** How much is seen of a robot over another one, and of a lost module. */
const TRANSLUCENT = 0.4;
const LOST = 0.22;

interface LinkView {
  name: string;
  module: string;
  object: Group;
  /** Seen where the link is not drawn with all others of its shape: selected, or seen through. It is what is picked. */
  mesh: Mesh<BufferGeometry, LinkMaterial>;
  frame: Mesh | null;
  /** The link where its module believes it to be. */
  ghost: Mesh | null;
  /** Around a link of the selected module. */
  outline: Mesh | null;
  shaped: boolean;
}

interface Trail {
  link: number;
  line: Line<BufferGeometry, LineBasicMaterial>;
  points: Float32Array;
}

export class RobotView {
  readonly group = new Group();
  /** The mean of the links' places as they were last shown, in the world of the run. */
  readonly centre = new Vector3();
  private links: LinkView[] = [];
  private readonly batches = new LinkBatches();
  /** How each module was drawn last. */
  private readonly looks = new Map<string, ModuleLook>();
  private readonly obstacles = new Map<string, Mesh<BufferGeometry, LinkMaterial>>();
  private trails: Trail[] = [];
  private trailKey = '';
  private structure = -1;
  private readonly forces = new ForceView();
  private readonly axes = axesGeometry();
  // Frames are seen through the links that they lie in.
  private readonly axesMaterial = new MeshBasicMaterial({ vertexColors: true, depthTest: false, transparent: true });
  private readonly ghostMaterial = new MeshBasicMaterial({
    color: PROPAGATED,
    transparent: true,
    opacity: 0.3,
    depthWrite: false,
  });

  private readonly outlineMaterial = new MeshBasicMaterial({ color: SELECTED, side: BackSide });

  constructor(readonly run: Run) {
    this.group.add(this.forces.group, this.batches.group);
  }

  /** The links' meshes, for picking. */
  get meshes(): Object3D[] {
    return this.links.map((link) => link.mesh);
  }

  /** The module that a mesh belongs to; null if it is none of this robot. */
  moduleOf(mesh: Object3D): string | null {
    return this.links.find((link) => link.mesh === mesh)?.module ?? null;
  }

  /** By module, of those that are `wanted` as they were last drawn, the mean place of its links in the world of the scene. */
  modulePlaces(wanted: (look: ModuleLook) => boolean = () => true): Map<string, Vector3> {
    const sums = new Map<string, { sum: Vector3; n: number }>();
    for (const link of this.links) {
      const look = this.looks.get(link.module);
      if (!link.object.visible || !look || !wanted(look)) continue;
      const entry = sums.get(link.module) ?? { sum: new Vector3(), n: 0 };
      entry.sum.add(link.object.position);
      entry.n++;
      sums.set(link.module, entry);
    }
    return new Map([...sums].map(([module, { sum, n }]) => [module, sum.divideScalar(n).add(this.group.position)]));
  }

  /** How many links are there to be seen. */
  get placed(): number {
    return this.links.filter((link) => link.object.visible).length;
  }

  /** The largest distance of a link from `centre`, with room for its shape, metres; and the half extent along z (east). */
  extent(): { radius: number; halfWidth: number } {
    let radius = 0;
    let halfWidth = 0;
    for (const link of this.links) {
      if (!link.object.visible) continue;
      radius = Math.max(radius, link.object.position.distanceTo(this.centre));
      halfWidth = Math.max(halfWidth, Math.abs(link.object.position.z - this.centre.z));
    }
    return { radius: radius + LINK_ROOM, halfWidth: halfWidth + LINK_ROOM };
  }

  /** Shows the robot as it was at `time`. `look` says how each module is drawn, `trailed` the links that leave trails. */
  show(
    time: number,
    options: RobotOptions,
    look: (module: string) => ModuleLook,
    selected: string | null,
    trailed: readonly string[],
  ): void {
    this.takeStructure();
    const row = this.run.poses.rowAt(time + 1e-9);
    this.centre.set(0, 0, 0);
    let n = 0;
    this.looks.clear();
    this.links.forEach((link, index) => {
      const pose = fixedPoseAt(this.run, index, row, time);
      link.object.visible = pose !== null;
      if (!pose) return;
      link.object.position.set(pose.p[0], pose.p[1], pose.p[2]);
      link.object.quaternion.set(pose.q[1], pose.q[2], pose.q[3], pose.q[0]);
      this.centre.add(link.object.position);
      n++;
      const known = this.looks.get(link.module) ?? look(link.module);
      this.looks.set(link.module, known);
      const opacity = known.lost ? LOST : options.translucent ? TRANSLUCENT : 1;
      this.showOutline(link, selected === link.module);
      this.paint(link, known.colour, selected === link.module, opacity);
      link.mesh.visible = selected === link.module || opacity < 1;
      this.showFrame(link, options.frames && (selected === null || selected === link.module));
    });
    this.showGhosts(time, options.propagated);
    this.forces.show(this.run, time, options.forces, (link) => this.placeOf(link));
    if (n) this.centre.divideScalar(n);
    this.showTrails(time, row, options, (module) => look(module).colour, trailed);
  }

  /** Draws what show() placed, as it is seen from there. */
  draw(sight: Sight): void {
    this.batches.begin();
    for (const { object, mesh } of this.links) {
      if (!object.visible || mesh.visible) continue;
      object.updateMatrix();
      this.batches.add(mesh.geometry, object.matrix, mesh.material.color, sight);
    }
    this.batches.end();
  }

  dispose(): void {
    this.outlineMaterial.dispose();
    for (const link of this.links) {
      link.outline?.geometry.dispose();
      link.mesh.material.dispose();
    }
    this.batches.dispose();
    for (const mesh of this.obstacles.values()) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.dropTrails();
    this.forces.dispose();
    this.axes.dispose();
    this.axesMaterial.dispose();
    this.ghostMaterial.dispose();
  }

  /** Where a link is drawn; null if nowhere. */
  private placeOf(name: string): Vector3 | null {
    const link = this.links[this.run.linkIndex(name)];
    return link?.object.visible ? link.object.position : null;
  }

  private showGhosts(time: number, visible: boolean): void {
    for (const link of this.links) {
      const pose = visible ? this.run.propagatedPose(link.name, time) : null;
      if (pose && !link.ghost) {
        link.ghost = new Mesh(link.mesh.geometry, this.ghostMaterial);
        this.group.add(link.ghost);
      }
      if (!link.ghost) continue;
      link.ghost.visible = pose !== null;
      if (!pose) continue;
      link.ghost.position.set(...pose.p);
      link.ghost.quaternion.set(pose.q[1], pose.q[2], pose.q[3], pose.q[0]);
    }
  }

  private paint(link: LinkView, colour: string, selected: boolean, opacity: number): void {
    const material = link.mesh.material;
    material.color.set(colour);
    material.emissive.set(selected ? colour : '#000000');
    material.emissiveIntensity = selected ? 0.45 : 0;
    if (material.opacity !== opacity) {
      material.opacity = opacity;
      material.transparent = opacity < 1;
      material.depthWrite = opacity === 1;
      material.needsUpdate = true;
    }
    material.setSelected(selected);
  }

  private showOutline(link: LinkView, visible: boolean): void {
    if (visible && !link.outline) {
      link.outline = new Mesh(outlineOf(link.mesh.geometry), this.outlineMaterial);
      link.object.add(link.outline);
    }
    if (link.outline) link.outline.visible = visible;
  }

  private showFrame(link: LinkView, visible: boolean): void {
    if (visible && !link.frame) {
      link.frame = new Mesh(this.axes, this.axesMaterial);
      link.frame.scale.setScalar(FRAME_SIZE);
      link.frame.renderOrder = 2;
      link.object.add(link.frame);
    }
    if (link.frame) link.frame.visible = visible;
  }

  /** Links and shapes that have become known. */
  private takeStructure(): void {
    if (this.structure === this.run.structureVersion) return;
    this.structure = this.run.structureVersion;
    this.run.links.forEach((name, index) => {
      const known = this.links[index];
      const shape = this.run.shapes.get(name);
      if (known && (known.shaped || !shape)) return;
      if (known) this.group.remove(known.object, ...(known.ghost ? [known.ghost] : []));
      this.links[index] = this.makeLink(name);
    });
    for (const [name, shape] of this.run.obstacles) {
      if (this.obstacles.has(name)) continue;
      const mesh = new Mesh(shapeGeometry(shape), new LinkMaterial());
      mesh.material.color.set(OBSTACLE_COLOUR);
      // Terrain is open, and is seen from below too.
      mesh.material.side = DoubleSide;
      this.obstacles.set(name, mesh);
      this.group.add(mesh);
    }
  }

  private makeLink(name: string): LinkView {
    const shape = this.run.shapes.get(name);
    const mesh = new Mesh(this.batches.geometryOf(shape), new LinkMaterial());
    const object = new Group();
    object.add(mesh);
    this.group.add(object);
    return { name, module: name.split('/')[0], object, mesh, frame: null, ghost: null, outline: null, shaped: shape !== undefined };
  }

  private dropTrails(): void {
    for (const trail of this.trails) {
      this.group.remove(trail.line);
      trail.line.geometry.dispose();
      trail.line.material.dispose();
    }
    this.trails = [];
  }

  private showTrails(
    time: number,
    row: number,
    options: RobotOptions,
    colour: (module: string) => string,
    trailed: readonly string[],
  ): void {
    const wanted = options.trails ? trailed : [];
    const key = wanted.join();
    if (key !== this.trailKey) {
      this.trailKey = key;
      this.dropTrails();
      for (const name of wanted) {
        const link = this.run.linkIndex(name);
        if (link < 0) continue;
        const points = new Float32Array(TRAIL_POINTS * 3);
        const geometry = new BufferGeometry();
        geometry.setAttribute('position', new BufferAttribute(points, 3));
        const line = new Line(geometry, new LineBasicMaterial());
        line.frustumCulled = false;
        this.group.add(line);
        this.trails.push({ link, line, points });
      }
    }
    const poses = this.run.poses;
    const first = Math.max(0, poses.lowerBound(time - TRAIL_SECONDS));
    const step = Math.max(1, Math.ceil((row - first + 1) / TRAIL_POINTS));
    for (const trail of this.trails) {
      let n = 0;
      const column = trail.link * POSE_COLUMNS.length;
      for (let r = first - (first % step) + step; r <= row && n < TRAIL_POINTS; r += step) {
        const x = poses.value(column, r);
        if (Number.isNaN(x)) continue;
        trail.points[3 * n] = x;
        trail.points[3 * n + 1] = poses.value(column + 1, r);
        trail.points[3 * n + 2] = poses.value(column + 2, r);
        n++;
      }
      trail.line.geometry.setDrawRange(0, n);
      trail.line.geometry.attributes.position.needsUpdate = true;
      trail.line.material.color.set(colour(this.run.links[trail.link].split('/')[0]));
    }
  }
}
