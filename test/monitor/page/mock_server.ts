/**
 * A server in the same process that speaks the monitor's protocol (docs/monitor-protocol.md), for tests of the page
 * without a network: it has its own little robots, and time passes in it when the test says so.
 */
import { create, createFileRegistry, fromBinary, toBinary, type DescMessage } from '@bufbuild/protobuf';
import { FileDescriptorSetSchema } from '@bufbuild/protobuf/wkt';
import type { Socket } from '../src/protocol/connection.ts';
import { MockClient } from './mock_client.ts';

/** Length of a control tick, microseconds. */
export const TICK_US = 20000;

export interface MockSource {
  name: string;
  kind: 'live' | 'log';
  robot: string;
  modules: number;
  /** Of a log: its last instant, seconds. */
  seconds?: number;
  /** By how far this robot's links lie east of where they should, metres: what a comparison is to find. */
  astray?: number;
  /** Its joints are mounted the other way round: values and conventions have the opposite sign. */
  mirrored?: boolean;
  /** Of a log: where its file is wrong. */
  damage?: { cut: boolean; time_us: number; what: string };
  /** It is the past of that live run. */
  pastOf?: string;
}

interface Topic {
  name: string;
  schema: string;
  latched: boolean;
}

const TOPICS: Topic[] = [
  { name: 'description', schema: 'morphbus.Description', latched: true },
  { name: 'scene', schema: 'foxglove.SceneUpdate', latched: true },
  { name: 'modules', schema: 'morphbus.Modules', latched: true },
  { name: 'connections', schema: 'morphbus.Connections', latched: true },
  { name: 'clock', schema: 'morphbus.Clock', latched: false },
  { name: 'tf', schema: 'foxglove.FrameTransforms', latched: false },
  { name: 'joints', schema: 'morphbus.Joints', latched: false },
  { name: 'faults', schema: 'morphbus.Fault', latched: false },
  { name: 'channels', schema: 'morphbus.Channels', latched: false },
  { name: 'tf_propagated', schema: 'foxglove.FrameTransforms', latched: false },
  { name: 'forces', schema: 'morphbus.Forces', latched: false },
  { name: 'traces', schema: 'morphbus.Traces', latched: false },
];

/** What the mock tells of two runs, and the number of the channel on which it does. */
const PAIRS: Topic = { name: 'pairs', schema: 'morphbus.Pairs', latched: true };
const PAIRS_ID = 9000;

/** One run of the mock: a row of modules of two cubes each, whose second cube swings and which walks north. */
class MockRun {
  tick = -1;
  paused = false;
  program = 1n;
  /** Commands that the next CLOCK names. */
  readonly said: string[] = [];
  /** Up to which tick somebody pushes m1 east. */
  pushedUntil = -1;
  /** A module that the run goes on without; the others then have no role. */
  lost = '';
  constructor(readonly source: MockSource) {}

  role(module: number): string {
    return this.program > 1n ? `Other${module}` : module === 1 ? 'Head' : `Leg${module}`;
  }

  names(): string[] {
    return Array.from({ length: this.source.modules }, (_, i) => `m${i + 1}`);
  }

  angle(module: number, time: number): number {
    return 0.6 * Math.sin(2 * Math.PI * 0.5 * time + module);
  }

  /** The convention of a module's joint. */
  sign(index: number): number {
    return (index % 2 ? -1 : 1) * (this.source.mirrored ? -1 : 1);
  }

  services(): string[] {
    return [...(this.source.kind === 'log' ? ['playback'] : ['control', 'deploy']), 'missing_roles', 'explain_role'];
  }
}

/** Shapes of messages as `create` of protobuf-es takes them. */
type Init = Record<string, unknown>;

export class MockServer {
  readonly runs: MockRun[];
  /** What clients asked for: service name and request. */
  readonly calls: { service: string; request: any }[] = [];
  /** False: whoever connects is turned away at once. */
  accepts = true;
  sessionId = 'first';
  private clients: MockClient[] = [];
  private readonly registry;
  private readonly schema: string;

  /** @param descriptors a FileDescriptorSet with monitor.proto and foxglove.proto. */
  constructor(
    descriptors: Uint8Array,
    sources: MockSource[],
    readonly control = true,
  ) {
    this.registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, descriptors));
    this.schema = btoa(Array.from(descriptors, (byte) => String.fromCharCode(byte)).join(''));
    this.runs = sources.map((source) => new MockRun(source));
  }

  open(): Socket {
    const client = new MockClient(this);
    this.clients.push(client);
    // A socket opens and closes after the call that made it.
    queueMicrotask(() => (this.accepts ? client.greet() : client.close()));
    return client;
  }

  forget(client: MockClient): void {
    this.clients = this.clients.filter((c) => c !== client);
  }

  /** Ends all connections, as a server does that is stopped. */
  disconnectAll(): void {
    for (const client of [...this.clients]) client.close();
  }

  /** Runs the live run of that name for so many ticks, unless it holds still. */
  advance(name: string, ticks: number): void {
    const run = this.run(name);
    for (let i = 0; i < ticks && !run.paused; i++) {
      run.tick++;
      this.sendTick(run, run.tick, this.clients);
    }
  }

  fault(name: string, fault: Init): void {
    const run = this.run(name);
    this.publish(run, 'faults', run.tick, { timestamp: stamp(run.tick), ...fault }, this.clients);
  }

  /** The run goes on without a module. */
  lose(name: string, module: string): void {
    const run = this.run(name);
    run.lost = module;
    this.sendLatched(run, 'modules', run.tick, this.clients);
  }

  run(name: string): MockRun {
    const run = this.runs.find((r) => r.source.name === name);
    if (!run) throw new Error(`the mock has no run ${name}`);
    return run;
  }

  greeting(): string[] {
    const sources = this.runs.map(({ source }) => ({
      name: source.name,
      kind: source.kind,
      robot: source.robot,
      ...(source.kind === 'log'
        ? { file: `${source.name}.log`, begin_us: 0, end_us: (source.seconds ?? 0) * 1e6, damage: source.damage ?? null, past_of: source.pastOf ?? '' }
        : {}),
    }));
    const channels = this.runs.flatMap((run, r) =>
      TOPICS.map((topic, t) => ({
        id: 100 * r + t,
        topic: `/${run.source.name}/${topic.name}`,
        encoding: 'protobuf',
        schemaName: topic.schema,
        schema: this.schema,
        schemaEncoding: 'protobuf',
      })),
    );
    if (this.runs.filter(({ source }) => !source.pastOf).length > 1)
      channels.push({
        id: PAIRS_ID,
        topic: `/${PAIRS.name}`,
        encoding: 'protobuf',
        schemaName: PAIRS.schema,
        schema: this.schema,
        schemaEncoding: 'protobuf',
      });
    const services = this.runs.flatMap((run, r) =>
      run.services().map((name, i) => ({
        id: 100 * r + i,
        name: `/${run.source.name}/${name}`,
        type: name,
      })),
    );
    return [
      {
        op: 'serverInfo',
        name: 'mock',
        capabilities: ['services', 'time', 'parameters'],
        sessionId: this.sessionId,
        metadata: { sources: JSON.stringify(sources), control: this.control ? 'yes' : 'no' },
      },
      { op: 'advertise', channels },
      { op: 'advertiseServices', services },
    ].map((message) => JSON.stringify(message));
  }

  /** What a new subscriber gets at once. */
  latch(client: MockClient, channelId: number): void {
    if (channelId === PAIRS_ID) return this.send(PAIRS.schema, PAIRS_ID, 0, this.pairs(), [client]);
    const run = this.runs[Math.floor(channelId / 100)];
    const topic = TOPICS[channelId % 100];
    if (topic.latched && (run.tick >= 0 || topic.name !== 'modules'))
      this.sendLatched(run, topic.name, Math.max(0, run.tick), [client]);
  }

  /** Does what a service is asked for. Throws a sentence if it refuses. */
  serve(client: MockClient, serviceId: number, request: any): unknown {
    const run = this.runs[Math.floor(serviceId / 100)];
    const service = run.services()[serviceId % 100];
    this.calls.push({ service: `/${run.source.name}/${service}`, request });
    if (service === 'missing_roles') return this.missingRoles(run, request);
    if (service === 'explain_role')
      return {
        time_us: request.time_us,
        ...{ module: request.module, role: request.role, line: 1, fits: true, lacks: '' },
        parts: [
          { label: 'foot', line: 1, holds: true, finding: 'is tip' },
          { label: '', line: 2, holds: true, finding: 'holds, measured 2 against 2' },
        ],
      };
    if (service === 'playback') return this.play(run, client, request);
    if (!this.control) throw new Error('This client gave no token.');
    if (service === 'deploy') {
      if (!String(request.text).includes('role')) throw new Error('walk.dyn:1:1: error: expected a role');
      run.program++;
      this.sendLatched(run, 'modules', run.tick, this.clients);
      return { tick: run.tick + 1, command: 'deploy' };
    }
    const words = String(request.command).split(' ');
    if (words[0] === 'pause' || words[0] === 'resume') run.paused = words[0] === 'pause';
    else if (words[0] === 'step') this.step(run, Number(words[1] ?? 1));
    else if (words[0] === 'set') run.said.push(`${words.join(' ')} 0123456789abcdef --at 9`);
    else if (words[0] === 'push') run.pushedUntil = run.tick + 10;
    else if (words[0] !== 'speed') throw new Error(`There is no command "${words[0]}".`);
    this.tellPaused(run);
    const answer = { tick: run.tick + 1, command: request.command };
    return words[0] === 'set' ? { ...answer, switch_seconds: 9 } : answer;
  }

  private missingRoles(run: MockRun, request: any): unknown {
    const without = run.lost ? run.names().filter((module) => module !== run.lost) : [];
    const lines = (module: string) => [
      { text: `not Head: this requirement fails, measured 1 against 2`, line: 1 },
      { text: `not ${run.role(Number(module.slice(1)))}: its type has no wheel`, line: 2 },
    ];
    return {
      time_us: request.time_us ?? run.tick * TICK_US,
      modules: Object.fromEntries(without.map((module) => [module, lines(module)])),
    };
  }

  /** The first modules of both robots belong together, and so on. */
  private pairs(): Init {
    const [a, b] = this.runs;
    const span = (sign: number): Init => ({ sinceUs: BigInt(TICK_US), sign });
    return {
      modules: a.names().map((module, i) => ({
        role: a.role(i + 1),
        moduleA: module,
        moduleB: module,
        links: [
          { label: '', labelled: false, linkA: 'base', linkB: 'base' },
          { label: 'foot', labelled: true, linkA: 'tip', linkB: 'tip' },
        ],
        joints: [
          {
            label: 'ankle',
            labelled: true,
            jointA: 'joint_1',
            jointB: 'joint_1',
            signsA: [span(a.sign(i))],
            signsB: [span(b.sign(i))],
          },
        ],
      })),
    };
  }

  private step(run: MockRun, ticks: number): void {
    run.paused = false;
    this.advance(run.source.name, ticks);
    run.paused = true;
  }

  private tellPaused(run: MockRun): void {
    for (const client of this.clients)
      client.sendText({
        op: 'parameterValues',
        parameters: [{ name: `/${run.source.name}/paused`, value: run.paused }],
      });
  }

  /** Plays a range of a log at once. */
  private play(run: MockRun, client: MockClient, request: any): unknown {
    const first = Math.round((request.from_us ?? (run.tick + 1) * TICK_US) / TICK_US);
    const last = Math.round(Math.min(request.to_us ?? Infinity, (run.source.seconds ?? 0) * 1e6) / TICK_US);
    if (request.from_us !== undefined)
      for (const topic of TOPICS) if (topic.latched) this.sendLatched(run, topic.name, first, [client]);
    for (run.tick = first; run.tick <= last; run.tick++) this.sendTick(run, run.tick, [client]);
    run.tick = last;
    client.sendText({ op: 'parameterValues', parameters: [{ name: `/${run.source.name}/paused`, value: true }] });
    return { playing: false, speed: 0, time_us: last * TICK_US };
  }

  private sendTick(run: MockRun, tick: number, clients: MockClient[]): void {
    const time = (tick * TICK_US) / 1e6;
    if (tick === 1) this.sendLatched(run, 'modules', tick, clients);
    this.publish(
      run,
      'clock',
      tick,
      { timestamp: stamp(tick), tick: BigInt(tick), phase: tick === 0 ? 0 : 1, controls: run.said.splice(0) },
      clients,
    );
    const transforms = run.names().flatMap((module, i) => this.transforms(run, module, i, time));
    this.publish(run, 'tf', tick, { transforms }, clients);
    this.publish(run, 'tf_propagated', tick, { transforms: this.propagated(run, transforms) }, clients);
    this.publish(run, 'forces', tick, this.forces(run, tick), clients);
    // m2's program traces a field.
    const traced = [{ name: 'phase', value: 3 * tick }];
    this.publish(run, 'traces', tick, { timestamp: stamp(tick), module: 'm2', role: 'Leg2', fields: traced }, clients);
    const joints = run.names().map((module, i) => ({
      module,
      joint: 'joint_1',
      position: run.angle(i, time) * (run.source.mirrored ? -1 : 1),
      velocity: 0.1 * i,
      effort: 0.5 * i,
      target: 0.5,
      sign: run.sign(i),
    }));
    this.publish(run, 'joints', tick, { timestamp: stamp(tick), tick: BigInt(tick), joints }, clients);
    if (tick % 50 === 0) {
      const channels = run.names().map((m) => ({
        channel: `${run.source.name}/${m}/TRANSFORM`,
        type: 'transform_t',
        messages: BigInt(tick),
        hz: 50,
        bytesPerS: 20000,
        lost: 0n,
        bad: 0n,
      }));
      channels.push({ ...channels[0], channel: `${run.source.name}/INFO`, type: 'info_part_t', messages: tick ? 1n : 0n });
      this.publish(run, 'channels', tick, { timestamp: stamp(tick), channels }, clients);
    }
  }

  /** Cube `base` stands, cube `tip` swings about the axis east; all walk north at 5 cm/s. */
  private transforms(run: MockRun, module: string, index: number, time: number): Init[] {
    const name = run.source.name;
    const half = run.angle(index, time) / 2;
    const place = { x: 0.05 * time, y: 0.04, z: 0.09 * index };
    const astray = run.source.astray ?? 0;
    const frame = (link: string, translation: Init, rotation: Init): Init => ({
      parentFrameId: `${name}/world`,
      childFrameId: `${name}/${module}/${link}`,
      translation,
      rotation,
    });
    return [
      frame('base', place, { x: 0, y: 0, z: 0, w: 1 }),
      frame(
        'tip',
        { ...place, y: 0.11, z: place.z + (time > 1 ? astray : 0) },
        { x: 0, y: 0, z: Math.sin(half), w: Math.cos(half) },
      ),
    ];
  }

  /** The modules believe that they are 3 cm higher than they are. */
  private propagated(run: MockRun, transforms: Init[]): Init[] {
    const { name } = run.source;
    const rotation = { x: 0, y: 0, z: 0, w: 1 };
    const robot = { parentFrameId: `${name}/world`, childFrameId: `${name}/robot`, translation: { x: 0, y: 0.03, z: 0 }, rotation };
    return [
      robot,
      ...transforms.map((t: any) => ({
        ...t,
        parentFrameId: `${name}/robot`,
        childFrameId: t.childFrameId.replace(name, `${name}/propagated`),
      })),
    ];
  }

  /** The ground bears every module, and m1 is pushed for a while. */
  private forces(run: MockRun, tick: number): Init {
    return {
      timestamp: stamp(tick),
      tick: BigInt(tick),
      contacts: run.names().map((module) => ({ module, link: 'base', north: 0.4, up: 8, east: 0 })),
      pushes: tick <= run.pushedUntil ? [{ module: 'm1', link: 'tip', north: 0, up: 0, east: 15 }] : [],
    };
  }

  private sendLatched(run: MockRun, topic: string, tick: number, clients: MockClient[]): void {
    const { name, robot } = run.source;
    const messages: Record<string, Init> = {
      description: {
        run: name,
        robot,
        modelFile: 'mock.m3l',
        programFile: 'mock.dyn',
        programText: 'role Head extends Module {\n}\n',
        mode: 'lockstep',
        tickUs: TICK_US,
        modules: run.names().map((m, id) => ({
          id,
          name: m,
          type: 'CUBE',
          links: ['base', 'tip'],
          joints: [{ name: 'joint_1', type: 'revolute', lower: -1.5, upper: 1.5, speed: 1 }],
          connectors: ['c1'],
        })),
        roles: run.names().map((_, i) => ({
          name: run.role(i + 1),
          commands: [{ name: 'lift', parameterTypes: ['float'] }],
          labels: ['foot'],
        })),
        parameters: [
          { name: 'swing', isInt: false, value: 30, least: 10, most: 60 },
          { name: 'Head.steps', isInt: true, value: 2, least: 1, most: 9 },
        ],
      },
      scene: {
        entities: run.names().flatMap((m) =>
          ['base', 'tip'].map((link) => ({
            id: `${name}/${m}/${link}`,
            frameId: `${name}/${m}/${link}`,
            frameLocked: true,
            // The base has a part of a colour of its own.
            triangles: link === 'base' ? [cube(0.03), { ...cube(0.01), color: { r: 1, g: 0.5, b: 0, a: 1 } }] : [cube(0.03)],
            metadata: link === 'base' ? [{ key: 'own_colors', value: '1' }] : [],
          })),
        ).concat([
          { id: `${name}/obstacles/block`, frameId: `${name}/world`, frameLocked: true, triangles: [cube(0.1)], metadata: [] },
        ]),
      },
      modules: {
        timestamp: stamp(tick),
        modules: run.names().map((module, i) => ({
          module,
          role: run.lost && module !== run.lost ? '' : run.role(i + 1),
          hasPose: true,
          incarnation: 1,
          programHash: run.program,
          labels: [
            { name: 'foot', part: { case: 'link', value: 'tip' } },
            { name: 'ankle', part: { case: 'joint', value: 'joint_1' } },
          ],
          signs: [{ joint: 'joint_1', sign: run.sign(i) }],
          lost: module === run.lost,
          tasks: [{ kind: 'behavior', function: `${run.role(i + 1)}.gait`, line: 3 }],
          endedBehaviors: i,
        })),
      },
      connections: {
        timestamp: stamp(tick),
        connections: run
          .names()
          .slice(1)
          .map((m, i) => ({ moduleA: `m${i + 1}`, connectorA: 'c1', moduleB: m, connectorB: 'c1' })),
      },
    };
    this.publish(run, topic, tick, messages[topic], clients);
  }

  private publish(run: MockRun, topic: string, tick: number, message: Init, clients: MockClient[]): void {
    const index = TOPICS.findIndex((t) => t.name === topic);
    this.send(TOPICS[index].schema, 100 * this.runs.indexOf(run) + index, tick, message, clients);
  }

  private send(schema: string, channel: number, tick: number, message: Init, clients: MockClient[]): void {
    const type = this.registry.getMessage(schema) as DescMessage;
    const payload = toBinary(type, create(type, message));
    for (const client of clients) client.sendMessage(channel, BigInt(tick) * BigInt(TICK_US) * 1000n, payload);
  }
}

function stamp(tick: number): Init {
  const us = Math.max(0, tick) * TICK_US;
  return { seconds: BigInt(Math.floor(us / 1e6)), nanos: (us % 1e6) * 1000 };
}

/** A cube of half the given side about the origin. */
function cube(half: number): Init {
  const corner = (i: number): Init => ({ x: i & 1 ? half : -half, y: i & 2 ? half : -half, z: i & 4 ? half : -half });
  const indices = [
    0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5,
  ];
  return { points: Array.from({ length: 8 }, (_, i) => corner(i)), indices, color: { r: 0.5, g: 0.5, b: 0.5, a: 1 } };
}
