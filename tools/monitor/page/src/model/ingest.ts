/** Takes up what the server sends of one source (docs/monitor-protocol.md) into its Run. */

import { toNumber, toSeconds, type Decoded } from '../protocol/decoder.ts';
import type { Pose } from './pose.ts';
import { setPose, type Run } from './run.ts';
import {
  FORCE_AXES,
  FORCE_COLUMNS,
  LINK_COLUMNS,
  MAX_REPORTS,
  POSE_COLUMNS,
  type Fault,
  type Label,
  type ModuleState,
  type SourcePlace,
} from './run_data.ts';

/** Topics that the page does not need, since others hold the same. */
export const UNNEEDED_TOPICS = ['joint_states', 'log'];

/** A topic of a source, "/SRC/name". */
export function parseTopic(topic: string): { source: string; name: string } | null {
  const match = /^\/([^/]+)\/(.+)$/.exec(topic);
  return match ? { source: match[1], name: match[2] } : null;
}

/** What is done with a message of each topic, by the topic's name below its source. */
const TAKERS = new Map(
  Object.entries<(run: Run, time: number, message: Decoded) => void>({
    description: takeDescription,
    scene: takeScene,
    tf: takeTransforms,
    tf_propagated: takePropagated,
    clock: takeClock,
    joints: takeJoints,
    commands: takeCommands,
    modules: (run, time, message) => message.modules.forEach((state: any) => run.takeState(time, moduleState(state))),
    connections: takeConnections,
    // These two have a time of their own, that of what happened.
    faults: (run, _, message) => run.takeFault({ ...(message as Fault), time: toSeconds(message.timestamp) }),
    prints: (run, _, message) => run.addEvent(toSeconds(message.timestamp), message.text, message as SourcePlace),
    traces: takeTraces,
    channels: takeChannels,
    health: takeHealth,
    forces: takeForces,
  }),
);

/** Takes up one message. `name`: of the topic below its source; `time`: its sim time, seconds. */
export function takeMessage(run: Run, name: string, time: number, message: Decoded): void {
  // What is said of one module or process at a time is newest for each of them.
  const of = message.module ?? message.process ?? '';
  run.newest.set(`${name} ${of}`.trimEnd(), { time, message });
  TAKERS.get(name)?.(run, time, message);
}

function takeDescription(run: Run, _: number, message: Decoded): void {
  const d = run.description;
  d.robot = message.robot;
  d.program = message.programFile;
  d.programText = message.programText;
  d.imported = new Map(message.imported.map((source: { file: string; text: string }) => [source.file, source.text]));
  d.tick = (message.tickUs || 20000) * 1e-6;
  d.modules = message.modules;
  d.roles = message.roles.filter((role: any) => !role.abstract);
  d.parameters = message.parameters;
  run.structureVersion++;
}

/** "SRC/m1/link" is "m1/link" to the run. */
function linkOf(run: Run, frame: string): string | null {
  const prefix = `${run.name}/`;
  if (!frame.startsWith(prefix)) return null;
  const link = frame.slice(prefix.length);
  return link.includes('/') && !link.startsWith('propagated/') ? link : null;
}

function takeScene(run: Run, _: number, message: Decoded): void {
  for (const entity of message.entities) {
    const obstacle = entity.frameId === `${run.name}/world` ? entity.id : null;
    const link = linkOf(run, entity.frameId);
    if (!link && !obstacle) continue;
    // All triangles of the entity in one list of points.
    const points: number[] = [];
    const indices: number[] = [];
    const own = new Set((entity.metadata.find((m: any) => m.key === 'own_colors')?.value ?? '').split(' '));
    const colours: number[] = [];
    for (const [number, list] of entity.triangles.entries()) {
      const base = points.length / 3;
      const c = list.color;
      const colour = own.has(String(number)) ? [c.r, c.g, c.b, 1] : [0, 0, 0, 0];
      for (let i = 0; i < list.points.length; i++) colours.push(...colour);
      for (const p of list.points) points.push(p.x, p.y, p.z);
      if (list.indices.length) for (const i of list.indices) indices.push(base + i);
      else for (let i = 0; i < list.points.length; i++) indices.push(base + i);
    }
    if (!points.length) continue;
    const ownColours = colours.some((c) => c) ? new Float32Array(colours) : null;
    const shape = { positions: new Float32Array(points), indices: new Uint32Array(indices), ownColours };
    if (obstacle) run.obstacles.set(obstacle, shape);
    else if (link) run.shapes.set(link, shape);
  }
  run.structureVersion++;
}

function poseOf(transform: any): Pose {
  const t = transform.translation ?? { x: 0, y: 0, z: 0 };
  const r = transform.rotation ?? { x: 0, y: 0, z: 0, w: 1 };
  return { p: [t.x, t.y, t.z], q: [r.w, r.x, r.y, r.z] };
}

/** Poses in W; those of a run without a simulated world are given in R, whose own pose comes with them. */
function takeTransforms(run: Run, time: number, message: Decoded): void {
  const world = `${run.name}/world`;
  const robot = `${run.name}/robot`;
  const inRobot = message.transforms.find((t: any) => t.childFrameId === robot && t.parentFrameId === world);
  if (inRobot) run.X_WR = poseOf(inRobot);
  const poses: { link: string; pose: Pose }[] = [];
  for (const transform of message.transforms) {
    const link = linkOf(run, transform.childFrameId);
    if (!link) continue;
    const pose = poseOf(transform);
    poses.push({ link, pose: transform.parentFrameId === robot ? run.inWorld(pose) : pose });
  }
  if (poses.length) run.takePoses(time, poses);
}

/** Poses in R, and R's own in W. */
function takePropagated(run: Run, time: number, message: Decoded): void {
  const unit = (column: string): string => (/(^|\.)q/.test(column) ? '' : 'm');
  const table = run.addTable('propagated', unit, message.transforms.length * POSE_COLUMNS.length);
  table.row(time);
  const prefix = `${run.name}/propagated/`;
  for (const transform of message.transforms) {
    const frame = transform.childFrameId;
    if (frame.startsWith(prefix)) setPose(table, table.columnsOf(frame.slice(prefix.length), LINK_COLUMNS), poseOf(transform));
    if (frame !== `${run.name}/robot`) continue;
    const robot = run.addTable('robot frame', unit, POSE_COLUMNS.length);
    robot.row(time);
    setPose(robot, robot.columnsOf('', POSE_COLUMNS), poseOf(transform));
  }
}

/** A link that nothing pushes any more is pushed by 0 N. */
function takeForces(run: Run, time: number, message: Decoded): void {
  for (const name of ['contacts', 'pushes']) {
    const table = run.addTable(name, () => 'N', 200);
    table.row(time);
    for (let column = 0; column < table.columnNames.length; column++) table.set(column, 0);
    for (const force of message[name]) {
      const first = table.columnsOf(`${force.module}/${force.link}`, FORCE_COLUMNS);
      // Several may push one link.
      FORCE_AXES.forEach((axis, i) => table.set(first + i, (table.value(first + i, table.length - 1) || 0) + force[axis]));
    }
  }
}

function takeClock(run: Run, time: number, message: Decoded): void {
  const clock = run.clock;
  const tick = toNumber(message.tick);
  if (tick < clock.tick && run.kind === 'live') run.clear();
  clock.tick = tick;
  clock.time = time;
  clock.ended = message.phase === 2;
  clock.endReason = message.endReason;
  for (const control of message.controls) {
    run.addEvent(time, control);
    run.takeSetting(control);
  }
  if (clock.ended) run.addEvent(time, clock.endReason || 'end of the run');
}

/** Columns of a joint in the tables of joints and of commands, in this order. */
const JOINT_COLUMNS = [' position', ' velocity', ' effort', ' target'];
const COMMAND_COLUMNS = [' target', ' speed'];

function takeJoints(run: Run, time: number, message: Decoded): void {
  const units = (column: string): string => jointUnit(run, column);
  const table = run.addTable('joints', units, message.joints.length * 4);
  table.row(time);
  for (const joint of message.joints) {
    const name = `${joint.module}.${joint.joint}`;
    const first = table.columnsOf(name, JOINT_COLUMNS);
    [joint.position, joint.velocity, joint.effort, joint.target ?? NaN].forEach((v, i) => table.set(first + i, v));
    if (joint.sign) table.set(table.column(`${name} under its convention`), joint.sign * joint.position);
  }
}

function jointUnit(run: Run, column: string): string {
  const [name, ...quantity] = column.split(' ');
  const [module, joint] = name.split('.');
  const info = run.description.modules.find((m) => m.name === module)?.joints.find((j) => j.name === joint);
  if (quantity[0] === 'effort') return info?.type === 'prismatic' ? 'N' : 'N m';
  const unit = info?.type === 'prismatic' ? 'm' : 'rad';
  return quantity[0] === 'velocity' || quantity[0] === 'speed' ? `${unit}/s` : unit;
}

function takeCommands(run: Run, time: number, message: Decoded): void {
  const table = run.addTable('commands', (column) => jointUnit(run, column), message.joints.length * 2);
  table.row(time);
  for (const order of message.joints) {
    const name = `${order.module}.${order.joint}`;
    const position = order.mode === 1;
    const first = table.columnsOf(name, COMMAND_COLUMNS);
    table.set(first, position ? order.target : NaN);
    table.set(first + 1, order.speed);
  }
  for (const order of message.connectors) {
    run.addEvent(time, `${order.module}.${order.connector}: ${order.state} = ${order.value}`);
  }
}

function moduleState(message: any): ModuleState {
  const labels: Label[] = message.labels.map((label: any) => {
    const { case: kind, value: target } = label.part;
    const sign = kind === 'joint' ? (message.signs.find((s: any) => s.joint === target)?.sign ?? 0) : 0;
    return { name: label.name, kind, target, sign };
  });
  const { programHash, ...told } = message;
  return { ...told, labels, program: programHash ? programHash.toString(16).padStart(16, '0') : '' };
}

function takeConnections(run: Run, time: number, message: Decoded): void {
  const now: string[] = message.connections.map(
    (c: any) => `${c.moduleA}.${c.connectorA} – ${c.moduleB}.${c.connectorB}`,
  );
  const before = run.connections.at(-1)?.list;
  if (before?.join() === now.join()) return;
  for (const connection of before ?? []) if (!now.includes(connection)) run.addEvent(time, `taken off: ${connection}`);
  for (const connection of before ? now : []) if (!before?.includes(connection)) run.addEvent(time, `connected: ${connection}`);
  run.connections.push({ time, list: now });
  if (run.connections.length > MAX_REPORTS) run.connections.shift();
}

function takeChannels(run: Run, time: number, message: Decoded): void {
  const unit = (column: string): string =>
    column.endsWith(' rate') ? 'Hz' : column.endsWith(' bandwidth') ? 'B/s' : '';
  const table = run.addTable('channels', unit, message.channels.length * 5);
  table.row(time);
  for (const c of message.channels) {
    run.channelTypes.set(c.channel, c.type);
    const messages = toNumber(c.messages);
    const set = (quantity: string, value: number): void => table.set(table.column(`${c.channel} ${quantity}`), value);
    set('count', messages);
    // What was said once has no rate.
    set('rate', messages > 1 ? c.hz : NaN);
    set('bandwidth', messages > 1 ? c.bytesPerS : NaN);
    set('lost', toNumber(c.lost));
    set('bad', toNumber(c.bad));
  }
  run.reportVersion++;
}

/** Values of the fields that a module's program traces: a table a module, as one may tell later than another. */
function takeTraces(run: Run, _: number, message: Decoded): void {
  const table = run.addTable(`traces ${message.module}`, () => '', message.fields.length);
  table.row(toSeconds(message.timestamp));
  // A program that is not known has no names of fields.
  for (const field of message.fields) if (field.name) table.set(table.column(field.name), field.value);
}

/** Ledgers come process by process, about once a second: each has a table of its own. */
function takeHealth(run: Run, time: number, message: Decoded): void {
  const unit = (column: string): string =>
    column === 'cpu' ? 's' : column === 'memory' ? 'kB' : column.endsWith('worst') ? 's' : '';
  const table = run.addTable(`health ${message.process}`, unit, 40);
  table.row(time);
  table.set(table.column('cpu'), toNumber(message.cpuUs) * 1e-6);
  table.set(table.column('memory'), toNumber(message.maxRssKb));
  for (const count of message.counts) table.set(table.column(count.name), toNumber(count.value));
  for (const late of message.lateness) {
    table.set(table.column(`${late.module} missed`), toNumber(late.missed));
    table.set(table.column(`${late.module} worst`), toNumber(late.worstUs) * 1e-6);
  }
  run.health.set(message.process, {
    cpu: toNumber(message.cpuUs) * 1e-6,
    memoryKb: toNumber(message.maxRssKb),
    refused: message.firstRefused,
  });
  run.reportVersion++;
}
