import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fieldsOf, seriesOf } from '../src/model/fields.ts';
import { endedText } from '../src/model/run_data.ts';
import { Session } from '../src/model/session.ts';
import { parseFrame } from '../src/protocol/messages.ts';
import { MockServer, type MockSource } from './mock_server.ts';

const descriptors = readFileSync(process.env.MORPHBUS_MONITOR_SCHEMAS ?? '');
const LIVE: MockSource = { name: 'walk', kind: 'live', robot: 'row', modules: 3 };

/** A session with a mock server, and timers that run out when the test says so. */
function start(sources: MockSource[], control = true) {
  const server = new MockServer(descriptors, sources, control);
  const timers: { seconds: number; action: () => void }[] = [];
  const session = new Session({
    open: () => server.open(),
    timer: (seconds, action) => {
      const timer = { seconds, action };
      timers.push(timer);
      return () => void timers.splice(timers.indexOf(timer), timers.includes(timer) ? 1 : 0);
    },
  });
  const notices: string[] = [];
  session.onNotice = (notice) => notices.push(notice.text);
  session.connection.connect();
  return { server, session, timers, notices };
}

/** Lets everything happen that is under way. */
const settle = (): Promise<void> => new Promise((resolve) => setImmediate(resolve));

test('a live run is taken up: links, shapes, roles, signs, joints', async () => {
  const { server, session } = start([LIVE]);
  await settle();
  server.advance('walk', 100);
  const [run] = session.runs;
  assert.equal(session.state, 'connected');
  assert.equal(run.description.robot, 'row');
  assert.equal(run.poses.length, 100);
  assert.equal(run.links.length, 6);
  assert.equal(run.shapes.get('m1/tip')?.indices?.length, 36);
  assert.equal(run.shapes.get('m1/tip')?.ownColours, null);
  // Of two cubes of eight corners the second one keeps its colour.
  const own = run.shapes.get('m1/base')?.ownColours;
  assert.equal(own?.length, 2 * 8 * 4);
  assert.deepEqual([...(own?.slice(28, 36) ?? [])], [0, 0, 0, 0, 1, 0.5, 0, 1]);
  assert.deepEqual([...run.obstacles.keys()], ['walk/obstacles/block']);
  assert.equal(run.obstacles.get('walk/obstacles/block')?.indices?.length, 36);
  const state = run.stateAt('m2', 1);
  assert.equal(state?.role, 'Leg2');
  assert.deepEqual(state?.labels, [
    { name: 'foot', kind: 'link', target: 'tip', sign: 0 },
    { name: 'ankle', kind: 'joint', target: 'joint_1', sign: -1 },
  ]);
  // What faults have ended is told beside the role.
  assert.ok(state);
  assert.equal(endedText(state), '1 behavior has ended by a fault');
  assert.equal(
    endedText({ ...state, endedBehaviors: 2, startupEnded: true }),
    'startup has ended by a fault, so nothing of the role starts, 2 behaviors have ended by a fault',
  );
  assert.equal(endedText({ ...state, endedBehaviors: 0 }), '');
  const X = run.pose(run.linkIndex('m2/base'), 50);
  [0.05, 0.04, 0.09].forEach((value, i) => assert.ok(Math.abs((X?.p[i] ?? NaN) - value) < 1e-12));
  assert.deepEqual(
    [0.98, 1, 1.98].map((time) => run.channelsAt(time).map(({ messages, rate }) => [messages, rate])[0]),
    // Counted every second; before that nothing had been told.
    [undefined, [50, 50], [50, 50]],
  );
  // What was said once has no rate.
  assert.deepEqual(
    run.channelsAt(1).filter((c) => c.messages === 1).map(({ name, rate }) => [name, rate]),
    [['walk/INFO', NaN]],
  );
  assert.deepEqual(session.range(), { begin: 0, end: 1.98, ended: false });
});

test('every number can be plotted, angles of links too', async () => {
  const { server, session } = start([LIVE]);
  await settle();
  server.advance('walk', 60);
  const [run] = session.runs;
  const ids = fieldsOf(run).map((field) => field.id);
  for (const id of [
    'walk|poses|m1/tip.x',
    'walk|poses|m1/tip.pitch',
    'walk|joints|m1.joint_1 position',
    'walk|joints|m1.joint_1 effort',
    'walk|channels|walk/m1/TRANSFORM rate',
  ])
    assert.ok(ids.includes(id), id);
  const joint = seriesOf(run.tables.get('joints'), 'm2.joint_1 position');
  const under = seriesOf(run.tables.get('joints'), 'm2.joint_1 under its convention');
  assert.equal(joint?.unit, 'rad');
  assert.equal(under?.series.value(30), -(joint?.series.value(30) ?? NaN));
  const effort = seriesOf(run.tables.get('joints'), 'm2.joint_1 effort');
  assert.equal(effort?.unit, 'N m');
  assert.equal(effort?.series.value(30), 0.5);
  // What a program traces, in every tick, under the module's role.
  const traced = fieldsOf(run).find((field) => field.id === 'walk|traces m2|phase');
  assert.equal(traced?.name, 'Leg2 (m2) phase');
  assert.equal(seriesOf(run.tables.get('traces m2'), 'phase')?.series.value(30), 90);
  // The tip turns about the axis east by the joint's angle.
  const pitch = seriesOf(run.tables.get('poses'), 'm2/tip.pitch');
  assert.ok(Math.abs(Math.abs(pitch?.series.value(30) ?? NaN) - Math.abs(joint?.series.value(30) ?? NaN)) < 1e-9);
});

test('a lost connection is tried again ever more seldom, and what was received stays', async () => {
  const { server, session, timers } = start([LIVE]);
  await settle();
  server.advance('walk', 50);
  server.accepts = false;
  server.disconnectAll();
  assert.equal(session.state, 'disconnected');
  const waits: number[] = [];
  for (let i = 0; i < 6; i++) {
    const timer = timers.pop();
    waits.push(timer?.seconds ?? NaN);
    timer?.action();
    await settle();
  }
  assert.deepEqual(waits, [0.5, 1, 2, 4, 5, 5]);
  assert.equal(session.runs[0].poses.length, 50);
  server.accepts = true;
  timers.pop()?.action();
  await settle();
  assert.equal(session.state, 'connected');
  server.advance('walk', 50);
  assert.equal(session.runs[0].poses.length, 100);
  assert.equal(session.runs[0].poses.beginTime, 0);
});

test('another run of the server is shown anew', async () => {
  const { server, session, timers } = start([LIVE]);
  await settle();
  server.advance('walk', 50);
  const before = session.runs[0];
  server.sessionId = 'second';
  server.disconnectAll();
  timers.pop()?.action();
  await settle();
  assert.notEqual(session.runs[0], before);
  assert.equal(session.runs[0].poses.length, 0);
});

test('commands are answered with their tick, and refusals with their reason', async () => {
  const { server, session } = start([LIVE]);
  await settle();
  server.advance('walk', 10);
  const [run] = session.runs;
  assert.equal((await session.command(run, 'pause')).tick, 10);
  assert.equal(run.clock.paused, true);
  server.advance('walk', 10);
  assert.equal(run.clock.tick, 9);
  await session.command(run, 'step 3');
  assert.equal(run.clock.tick, 12);
  await assert.rejects(session.command(run, 'dance'), /no command "dance"/);
  await assert.rejects(session.deploy(run, 'walk.dyn', 'rubbish', ''), /walk.dyn:1:1: error/);
  await session.deploy(run, 'walk.dyn', 'role A extends Module {}', 'm2');
  assert.deepEqual(server.calls.at(-1), {
    service: '/walk/deploy',
    request: { name: 'walk.dyn', text: 'role A extends Module {}', to: 'm2' },
  });
  assert.equal(run.lastState('m1')?.role, 'Other1');
  assert.equal(run.stateAt('m1', 0.1)?.role, 'Head');
  assert.ok(run.events.list.some((event) => event.text === 'm1: Other1'));
});

test('a call whose connection breaks is told so', async () => {
  const { server, session } = start([LIVE]);
  await settle();
  server.serve = () => {
    server.disconnectAll();
    return {};
  };
  await assert.rejects(session.command(session.runs[0], 'pause'), /lost before the answer/);
  await assert.rejects(session.command(session.runs[0], 'pause'), /no connection/);
});

test('a page without the token knows it', async () => {
  const { session } = start([LIVE], false);
  await settle();
  assert.equal(session.mayControl, false);
  await assert.rejects(session.command(session.runs[0], 'pause'), /no token/);
});

test('faults come with their line', async () => {
  const { server, session } = start([LIVE]);
  await settle();
  server.advance('walk', 5);
  server.fault('walk', {
    module: 'm2',
    role: 'Leg2',
    name: 'division by zero',
    text: 'Leg2 divides by zero',
    file: 'mock.dyn',
    line: 7,
    sourceLine: '  x / y;',
    function: 'Leg2.gait',
  });
  const [fault] = session.runs[0].faults.list;
  assert.deepEqual([fault.module, fault.file, fault.line, fault.sourceLine], ['m2', 'mock.dyn', 7, '  x / y;']);
  assert.ok(Math.abs(fault.time - 0.08) < 1e-9);
});

test('a log is loaded at once, and one that is longer than memory in stretches around what is shown', async () => {
  const { server, session } = start([{ name: 'night', kind: 'log', robot: 'row', modules: 3, seconds: 1500 }]);
  await settle();
  const [run] = session.runs;
  assert.equal(server.calls[0].request.speed, 0);
  assert.equal(server.calls[0].request.from_us, 0);
  assert.equal(session.loaded(run), 1);
  assert.deepEqual(session.span(), { begin: 0, end: 1500 });
  const loaded = run.poses.endTime;
  assert.ok(loaded < 1500 && loaded > 60);
  // As the view comes near the end of what is loaded, more is asked for.
  session.provide(loaded - 1);
  await settle();
  assert.ok(run.poses.endTime > loaded);
  // A jump far ahead loads that stretch.
  session.provide(1400);
  await settle();
  assert.ok(run.poses.beginTime > loaded && run.poses.beginTime < 1400 && run.poses.endTime >= 1400);
  session.provide(3);
  await settle();
  assert.equal(run.poses.beginTime, 0);
  assert.ok(run.poses.length <= run.poses.capacity);
});

test('two runs are compared by role and label', async () => {
  const { session } = start([
    { name: 'a', kind: 'log', robot: 'row', modules: 3, seconds: 4 },
    { name: 'b', kind: 'log', robot: 'row', modules: 3, seconds: 4, astray: 0.003 },
  ]);
  await settle();
  const { difference } = session;
  difference?.update();
  assert.deepEqual(difference?.pairNames, ['Head.foot', 'Leg2.foot', 'Leg3.foot']);
  assert.equal(difference?.reference, 0);
  assert.equal(difference?.at('Leg2.foot', 0.5)?.position, 0);
  assert.ok(Math.abs((difference?.at('Leg2.foot', 3)?.position ?? NaN) - 0.003) < 1e-12);
  assert.ok(Math.abs((difference?.maximum('Head.foot position') ?? NaN) - 0.003) < 1e-12);
  assert.ok((difference?.maximum('Head.foot rotation') ?? NaN) < 1e-7);
  assert.equal(difference?.table.length, 201);
});

test('frames that are cut or of no known kind are counted and do no harm', async () => {
  assert.equal(parseFrame(new ArrayBuffer(0)), null);
  assert.equal(parseFrame(new Uint8Array([1, 2, 3]).buffer), null);
  assert.equal(parseFrame(new Uint8Array([9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).buffer), null);
  const lying = new Uint8Array(20);
  lying.set([3, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 0, 0]);
  assert.equal(parseFrame(lying.buffer), null);
  const { server, session, notices } = start([LIVE]);
  await settle();
  const client = (server as any).clients[0];
  for (const data of [
    '{',
    new ArrayBuffer(0),
    new Uint8Array([1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255]).buffer,
  ])
    client.onmessage({ data });
  client.onmessage({
    data: JSON.stringify({
      op: 'advertise',
      channels: [{ id: 999, topic: '/walk/odd', encoding: 'cbor', schemaName: '', schema: '' }],
    }),
  });
  assert.ok(session.connection.unreadable >= 3);
  assert.match(notices[0], /encoding "cbor"/);
  server.advance('walk', 3);
  assert.equal(session.runs[0].poses.length, 3);
});
