/** The 3D view: robots on the ground, seen by a camera that can follow them. */

import {
  AmbientLight,
  Color,
  DirectionalLight,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Run } from '../model/run.ts';
import { Ground } from './ground.ts';
import { sightOf } from './link_batches.ts';
import { RobotView, type ModuleLook, type RobotOptions } from './robot_view.ts';
import { ViewOverlay } from './overlay.ts';

/** What the view shows. */
export interface ViewOptions extends RobotOptions {
  colourBy: 'role' | 'module';
  ground: boolean;
  /** Where drawing is slow, fewer pixels are drawn of what moves; without it pictures can be compared. */
  adaptive: boolean;
  names: boolean;
  follow: boolean;
  /** Two robots: beside each other, or one over the other. */
  layout: 'beside' | 'over';
}

/** Colours of the scene in a theme. */
const THEMES = {
  light: { sky: '#eef1f5', ground: '#e4e8ee', fine: '#cdd4de', coarse: '#a9b4c2' },
  dark: { sky: '#14181e', ground: '#191e26', fine: '#272e39', coarse: '#3a4453' },
};

/** Frames that follow each other later than this are slow, milliseconds; and how coarse pixels may get for it. */
const SLOW_FRAME = 45;
const LEAST_PIXEL_RATIO = 0.75;
/** Without a graphics card: how long nothing has moved, milliseconds, when it is drawn with so many pixels that edges are smooth. */
const STILL_AFTER = 250;
const STILL_PIXEL_RATIO = 2;
/** How far the camera may go from most robots, and how far it sees, metres. */
const MOST_DISTANCE = 12;
const FAR = 40;
/** Robots that moved by less than this, metres, are not followed. */
const FOLLOW_FROM = 1e-4;

/** From where the camera looks at first, and how high robots are seen from there, compared to how wide. */
const VIEWPOINT = new Vector3(-0.6, 0.5, 0.72).normalize();
const FLATNESS = 0.92;

/** Whether this browser draws without a graphics card; how, its WebGL says in words. */
function drawsInSoftware(): boolean {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = gl?.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER) as string | undefined;
  // Browsers keep few contexts at a time.
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name ?? '');
}

export class View3D {
  readonly options: ViewOptions = {
    colourBy: 'role',
    ground: true,
    adaptive: true,
    names: false,
    follow: true,
    frames: false,
    trails: true,
    propagated: false,
    forces: true,
    translucent: false,
    layout: 'beside',
  };
  /** Who is asked for a module's colour. */
  colour: (run: Run, module: string) => string = () => '#888888';
  /** Whether the run had gone on without a module at the instant that is shown. */
  lost: (run: Run, module: string) => boolean = () => false;
  /** The links of a run that leave trails. */
  trailed: (run: Run) => readonly string[] = () => [];
  selected: { run: Run; module: string } | null = null;
  onSelect: (selection: { run: Run; module: string } | null) => void = () => {};
  /** Frames that were drawn so far, for measurements. */
  frames = 0;

  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(38, 1, 0.02, FAR);
  private readonly renderer: WebGLRenderer;
  private readonly controls: OrbitControls;
  private readonly ground = new Ground();
  private readonly overlay: ViewOverlay;
  private robots: RobotView[] = [];
  private readonly target = new Vector3(0, 0.08, 0);
  private framed = false;
  /** How many links were seen when the camera was placed, and whether somebody has placed it elsewhere since. */
  private framedLinks = 0;
  private held = false;
  private wantedCamera: number[] | null = null;
  private dirty = true;
  private shownTime = NaN;
  private pixelRatio = Math.min(window.devicePixelRatio || 1, 2);
  private slowFrames = 0;
  private lastDrawn = NaN;
  private drawnAt = 0;
  private readonly inSoftware = drawsInSoftware();
  /** Whether what is seen has been drawn with STILL_PIXEL_RATIO. */
  private sharp = false;

  /**
   * @param container the element that the view fills.
   * @throws Error if the browser has no WebGL.
   */
  constructor(private readonly container: HTMLElement) {
    // Smooth edges cost software a third of its frames; what stands still gets them otherwise.
    this.renderer = new WebGLRenderer({ antialias: !this.inSoftware, powerPreference: 'low-power' });
    const canvas = this.renderer.domElement;
    canvas.setAttribute('role', 'img');
    canvas.setAttribute(
      'aria-label',
      'The robots in three dimensions. Drag turns the view, the wheel zooms, a click selects a module.',
    );
    canvas.tabIndex = 0;
    container.prepend(canvas);
    this.overlay = new ViewOverlay(container);
    const sun = new DirectionalLight('#ffffff', 2.0);
    sun.position.set(0.8, 2, 1.2);
    this.scene.add(sun, new AmbientLight('#ffffff', 1.3));
    this.scene.add(this.ground.mesh);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = Math.PI * 0.495;
    this.controls.minDistance = 0.15;
    this.controls.maxDistance = MOST_DISTANCE;
    // A click that selects a module moves nothing.
    let grasped = false;
    this.controls.addEventListener('start', () => (grasped = true));
    this.controls.addEventListener('end', () => (grasped = false));
    this.controls.addEventListener('change', () => {
      this.dirty = true;
      this.held ||= grasped;
    });
    this.resetCamera();
    this.listenForClicks(canvas);
    // A canvas that changes its size is empty: it is drawn again before the browser shows it.
    new ResizeObserver(() => {
      this.resize();
      this.render(this.shownTime);
    }).observe(container);
    this.resize();
    this.setTheme(false);
  }

  setTheme(dark: boolean): void {
    const theme = dark ? THEMES.dark : THEMES.light;
    this.scene.background = new Color(theme.sky);
    this.ground.setTheme(theme);
    this.dirty = true;
  }

  /** Shows these runs, one or two, in place of those from before. */
  setRuns(runs: readonly Run[]): void {
    for (const robot of this.robots) {
      this.scene.remove(robot.group);
      robot.dispose();
    }
    this.robots = runs.map((run) => new RobotView(run));
    for (const robot of this.robots) this.scene.add(robot.group);
    this.framed = false;
    this.framedLinks = 0;
    this.held = false;
    this.dirty = true;
  }

  /** Where the camera is and looks to, relative to where the robots are. */
  get cameraPlace(): number[] {
    const relative = (v: Vector3): number[] => v.clone().sub(this.target).toArray();
    return [...relative(this.camera.position), ...relative(this.controls.target)];
  }

  /** Puts the camera there as soon as the robots are. */
  setCamera(place: readonly number[]): void {
    this.wantedCamera = [...place];
    this.dirty = true;
  }

  /**
   * Draws with so many pixels to each of the page until what it returns is called: no fewer, and more only where nothing
   * else makes edges smooth.
   */
  fix(pixelRatio: number): () => void {
    const before = { pixelRatio: this.pixelRatio, adaptive: this.options.adaptive };
    this.pixelRatio = this.inSoftware ? Math.max(STILL_PIXEL_RATIO, pixelRatio) : pixelRatio;
    this.options.adaptive = false;
    this.resize();
    return () => {
      this.pixelRatio = before.pixelRatio;
      this.options.adaptive = before.adaptive;
      this.resize();
    };
  }

  /** Something of what is shown has changed: the next call of render() draws. */
  touch(): void {
    this.dirty = true;
  }

  /** Looks at the robots from where the view begins: from the south-east, somewhat above, so near that they fill it. */
  private resetCamera(): void {
    let radius = 0.35;
    for (const robot of this.robots) {
      if (!robot.run.poses.length) continue;
      const place = robot.centre.clone().add(robot.group.position);
      radius = Math.max(radius, robot.extent().radius + place.distanceTo(this.target));
    }
    // Robots are wider than high: the sphere around them needs all of the view's width, and less of its height.
    const half = (this.camera.fov * Math.PI) / 360;
    const halfWidth = Math.atan(Math.tan(half) * this.camera.aspect);
    const distance = Math.max(radius / Math.sin(halfWidth), (FLATNESS * radius) / Math.sin(half));
    // Of a robot of many metres both ends are in sight, too.
    this.controls.maxDistance = Math.max(MOST_DISTANCE, 2 * distance);
    this.camera.far = Math.max(FAR, 2 * this.controls.maxDistance);
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(this.target);
    this.camera.position.copy(this.target).addScaledVector(VIEWPOINT, distance * 0.95);
    this.controls.update();
    this.dirty = true;
  }

  /** Shows the robots as they were at `time`, if anything has changed since the last call. */
  render(time: number): boolean {
    if (!this.dirty) {
      this.lastDrawn = NaN;
      if (!this.sharp && performance.now() - this.drawnAt > STILL_AFTER) this.sharpen();
      return false;
    }
    this.dirty = false;
    if (this.sharp) this.setPixelRatio(this.pixelRatio);
    this.sharp = false;
    this.shownTime = time;
    this.placeRobots(time);
    this.followRobots();
    for (const robot of this.robots) {
      robot.draw(sightOf(this.camera, this.container.clientHeight, robot.group.position));
    }
    this.renderer.render(this.scene, this.camera);
    this.overlay.draw(this.camera, this.names());
    this.frames++;
    this.drawnAt = performance.now();
    this.adaptResolution(this.drawnAt);
    return true;
  }

  /** Draws what stands still once more, with as many pixels as make edges smooth where WebGL does not. */
  private sharpen(): void {
    if (!this.inSoftware || !this.options.adaptive) return;
    this.sharp = true;
    this.setPixelRatio(STILL_PIXEL_RATIO);
    this.renderer.render(this.scene, this.camera);
  }

  private setPixelRatio(ratio: number): void {
    this.renderer.setPixelRatio(ratio);
    this.ground.setPixelRatio(ratio);
  }

  private placeRobots(time: number): void {
    const beside = this.robots.length > 1 && this.options.layout === 'beside';
    this.robots.forEach((robot, i) => {
      const look = (module: string): ModuleLook => ({
        colour: this.colour(robot.run, module),
        lost: this.lost(robot.run, module),
      });
      const selected = this.selected?.run === robot.run ? this.selected.module : null;
      const options = { ...this.options, translucent: this.robots.length > 1 && !beside && i > 0 };
      robot.show(time, options, look, selected, this.trailed(robot.run));
    });
    // Where modules become known one after the other, the camera goes back for them until somebody has placed it.
    const links = this.robots.reduce((sum, robot) => sum + robot.placed, 0);
    if (links > this.framedLinks && !this.held) this.framed = false;
    if (!this.framed) this.framedLinks = links;
    if (beside && !this.framed) {
      const gap = this.robots[0].extent().halfWidth + this.robots[1].extent().halfWidth + 0.1;
      this.robots[0].group.position.z = -gap / 2;
      this.robots[1].group.position.z = gap / 2;
    } else if (!beside) {
      for (const robot of this.robots) robot.group.position.z = 0;
    }
  }

  /** Keeps the camera's place relative to the robots, or leaves it where it is. */
  private followRobots(): void {
    const shown = this.robots.filter((robot) => robot.run.poses.length > 0);
    if (!shown.length) return;
    const centre = new Vector3();
    for (const robot of shown) centre.add(robot.centre).add(robot.group.position);
    centre.divideScalar(shown.length);
    if (!this.framed) {
      this.framed = shown.length === this.robots.length;
      this.target.copy(centre);
      this.resetCamera();
    } else if (this.options.follow) {
      const step = centre.clone().sub(this.target);
      // The up-and-down of a gait is the robot's, not the camera's.
      step.y *= 0.1;
      if (step.length() > FOLLOW_FROM) {
        this.controls.target.add(step);
        this.camera.position.add(step);
        this.controls.update();
        this.target.add(step);
      }
    }
    if (this.wantedCamera && this.framed) {
      const [x, y, z, ...to] = this.wantedCamera;
      this.wantedCamera = null;
      this.held = true;
      this.camera.position.set(x, y, z).add(this.target);
      this.controls.target.set(to[0], to[1], to[2]).add(this.target);
      this.controls.update();
    }
    this.ground.mesh.visible = this.options.ground;
    this.ground.moveTo(this.controls.target.x, this.controls.target.z);
  }

  /** Lays robots and camera out anew with the next frame, after a change of layout. */
  reframe(): void {
    this.framed = false;
    this.held = false;
    this.dirty = true;
  }

  /** Names of modules, and of the robots where there are two beside each other. */
  private names(): { text: string; place: Vector3; kind: string }[] {
    const names: { text: string; place: Vector3; kind: string }[] = [];
    for (const robot of this.robots) {
      for (const [module, place] of robot.modulePlaces((look) => look.lost)) {
        names.push({ text: `${module} lost`, place, kind: 'lost' });
      }
      for (const [module, place] of robot.modulePlaces((look) => this.options.names && !look.lost)) {
        names.push({ text: module, place, kind: 'module' });
      }
      if (this.robots.length < 2 || this.options.layout !== 'beside' || !robot.run.poses.length) continue;
      const place = robot.centre.clone().add(robot.group.position);
      place.y += 0.2;
      names.push({ text: `${robot.run.letter} · ${robot.run.name}`, place, kind: 'robot' });
    }
    return names;
  }

  /**
   * On machines that draw slowly, by software for one, fewer pixels are drawn rather than fewer frames. What counts is
   * the time from one drawn frame to the next, milliseconds: most of the work is done elsewhere than in this thread.
   */
  private adaptResolution(now: number): void {
    const passed = now - this.lastDrawn;
    this.lastDrawn = now;
    if (Number.isNaN(passed) || !this.options.adaptive) return;
    this.slowFrames = passed > SLOW_FRAME ? this.slowFrames + 1 : Math.max(0, this.slowFrames - 1);
    if (this.slowFrames > 20 && this.pixelRatio > LEAST_PIXEL_RATIO) {
      this.slowFrames = 0;
      this.pixelRatio = Math.max(LEAST_PIXEL_RATIO, this.pixelRatio * 0.8);
      this.resize();
    }
  }

  private resize(): void {
    const width = Math.max(1, this.container.clientWidth);
    const height = Math.max(1, this.container.clientHeight);
    this.setPixelRatio(this.pixelRatio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    // In a narrow view the robot must still fit from left to right.
    this.camera.fov = width < height * 1.2 ? 50 : 38;
    this.camera.updateProjectionMatrix();
    this.overlay.resize(width, height);
    this.dirty = true;
  }

  /** A click that is no drag selects the module under it. */
  private listenForClicks(canvas: HTMLCanvasElement): void {
    let down = { x: 0, y: 0 };
    canvas.addEventListener('pointerdown', (event) => (down = { x: event.clientX, y: event.clientY }));
    canvas.addEventListener('pointerup', (event) => {
      if (Math.hypot(event.clientX - down.x, event.clientY - down.y) > 4) return;
      const box = canvas.getBoundingClientRect();
      const place = new Vector2(
        ((event.clientX - box.left) / box.width) * 2 - 1,
        1 - ((event.clientY - box.top) / box.height) * 2,
      );
      const ray = new Raycaster();
      ray.setFromCamera(place, this.camera);
      const hit = ray.intersectObjects(
        this.robots.flatMap((robot) => robot.meshes),
        false,
      )[0];
      const robot = hit && this.robots.find((r) => r.moduleOf(hit.object) !== null);
      const module = robot && hit ? robot.moduleOf(hit.object) : null;
      this.onSelect(robot && module ? { run: robot.run, module } : null);
    });
  }
}
