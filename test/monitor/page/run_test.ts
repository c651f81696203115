import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decimate } from '../src/plot/decimate.ts';
import { niceTicks, tickText, timeText } from '../src/plot/ticks.ts';
import { Plot } from '../src/plot/plot.ts';
import { RoleQuestions } from '../src/model/role_questions.ts';
import { Run } from '../src/model/run.ts';
import { takeMessage } from '../src/model/ingest.ts';
import { Table } from '../src/model/table.ts';
import { ViewClock } from '../src/model/view_clock.ts';
import { angleBetween, compose, fixedAngles, invert, rotate, type Pose, type Quaternion } from '../src/model/pose.ts';
import { Color, Matrix4, Mesh, PerspectiveCamera, Vector3 } from 'three';
import { LinkBatches, sightOf } from '../src/view3d/link_batches.ts';
import { keyName } from '../src/ui/keyboard.ts';
import { hashOf } from '../src/ui/layout.ts';
import { matchFields } from '../src/model/fields.ts';

function filled(capacity: number, rows: number): Table {
  const table = new Table(capacity);
  for (let i = 0; i < rows; i++) {
    table.row(i * 0.5);
    table.set(table.column('a'), i);
  }
  return table;
}

test('a table keeps the newest rows in order and no more than its capacity', () => {
  const table = filled(1000, 3500);
  assert.equal(table.length, 1000);
  assert.equal(table.value(0, 0), 2500);
  for (let row = 0; row < 1000; row++) {
    assert.equal(table.value(0, row), 2500 + row);
    assert.equal(table.time(row), (2500 + row) * 0.5);
  }
  assert.equal(table.bytes, 2 * 8 * 1000);
});

test('a table finds the row of any time', () => {
  const table = filled(700, 1000);
  assert.equal(table.rowAt(149.9), -1);
  for (let row = 0; row < 700; row++) {
    const time = table.time(row);
    assert.equal(table.rowAt(time), row);
    assert.equal(table.rowAt(time + 0.2), row);
    assert.equal(table.lowerBound(time - 0.2), row);
  }
  assert.equal(table.rowAt(1e9), 699);
});

test('columns that come later are empty before', () => {
  const table = filled(100, 30);
  const late = table.column('b');
  table.set(late, 7);
  assert.ok(Number.isNaN(table.value(late, 28)));
  assert.equal(table.value(late, 29), 7);
  table.row(99);
  assert.ok(Number.isNaN(table.value(0, 30)));
});

test('time that steps back takes the place of what was there from then on', () => {
  const table = filled(100, 80);
  table.row(10);
  table.set(0, -1);
  assert.equal(table.length, 21);
  assert.equal(table.endTime, 10);
  assert.equal(table.value(0, 20), -1);
  table.row(10);
  assert.equal(table.length, 21);
});

test('decimation keeps every peak, the ends, and few points', () => {
  const n = 100_000;
  const values = Float64Array.from({ length: n }, (_, i) => Math.sin(i / 700));
  values[54_321] = 9;
  values[54_400] = -9;
  const series = {
    length: n,
    time: (i: number) => i,
    value: (i: number) => values[i],
    lowerBound: (t: number) => Math.max(0, Math.min(n, Math.ceil(t))),
  };
  const line = decimate(series, 0, n, 500);
  assert.ok(line.times.length <= 4 * 501);
  assert.equal(Math.max(...line.values), 9);
  assert.equal(Math.min(...line.values), -9);
  assert.equal(line.times[0], 0);
  assert.equal(line.times.at(-1), n - 1);
  for (let i = 1; i < line.times.length; i++) assert.ok(line.times[i] > line.times[i - 1]);
  // Whatever stretch is looked at, its extremes are those of the rows in it.
  for (const [from, to] of [
    [50_000, 60_000],
    [54_321, 54_322],
    [99_000, 200_000],
  ]) {
    const part = decimate(series, from, to, 100);
    const rows = [...values.subarray(Math.max(0, from - 1), Math.min(n, to + 1))];
    assert.equal(Math.max(...part.values), Math.max(...rows));
    assert.equal(Math.min(...part.values), Math.min(...rows));
  }
});

test('a series with gaps keeps its values, and one without rows is an empty line', () => {
  const values = Array.from({ length: 5000 }, (_, i) => (i % 2 ? NaN : i));
  const series = {
    length: 5000,
    time: (i: number) => i,
    value: (i: number) => values[i],
    lowerBound: (t: number) => Math.min(5000, Math.ceil(t)),
  };
  assert.equal(Math.max(...decimate(series, 0, 5000, 50).values.filter((v) => !Number.isNaN(v))), 4998);
  assert.deepEqual(decimate({ ...series, length: 0, lowerBound: () => 0 }, 0, 1, 10), { times: [], values: [] });
});

test('axes have round numbers', () => {
  assert.deepEqual(niceTicks(0, 10, 5), [0, 2, 4, 6, 8, 10]);
  assert.deepEqual(
    niceTicks(-0.3, 0.3, 3).map((t) => tickText(t, 0.2)),
    ['-0.2', '0.0', '0.2'],
  );
  assert.equal(timeText(83.456), '1:23.46');
  assert.equal(timeText(59.999), '1:00.00');
  assert.equal(timeText(7, 0), '0:07');
});

test('the clock follows, holds, plays at a speed, and stops at the end of what is over', () => {
  const clock = new ViewClock();
  assert.ok(Number.isNaN(clock.advance(0, NaN, NaN, false)));
  assert.equal(clock.advance(1, 0, 5, false), 5);
  clock.pause();
  assert.equal(clock.advance(2, 0, 6, false), 5);
  clock.seek(1);
  clock.speed = 0.5;
  clock.play();
  assert.equal(clock.advance(2.25, 0, 6, false), 1.125);
  // A page that was hidden for an hour goes on where it was.
  assert.equal(clock.advance(3600, 0, 6, false), 1.25);
  // What is held falls out of what is still there: the oldest instant is shown.
  clock.pause();
  assert.equal(clock.advance(3601, 3, 9, false), 3);
  clock.seek(8);
  clock.speed = 10;
  clock.play();
  assert.equal(clock.advance(3602, 3, 9, true), 9);
  assert.equal(clock.mode, 'hold');
  clock.seek(8);
  clock.play();
  clock.advance(3603, 3, 9, false);
  assert.equal(clock.mode, 'follow');
});

test('poses compose, invert and turn as their matrices do', () => {
  const q = (axis: number[], angle: number): Quaternion =>
    [Math.cos(angle / 2), ...axis.map((a) => a * Math.sin(angle / 2))] as Quaternion;
  const X: Pose = { p: [1, 2, 3], q: q([0, 0, 1], 0.7) };
  const Y: Pose = { p: [-2, 0.5, 1], q: q([1, 0, 0], -1.2) };
  const back = compose(invert(compose(X, Y)), compose(X, Y));
  back.p.forEach((v) => assert.ok(Math.abs(v) < 1e-12));
  assert.ok(angleBetween(back.q, [1, 0, 0, 0]) < 1e-7);
  const turned = rotate(q([0, 1, 0], Math.PI / 2), [1, 0, 0]);
  [0, 0, -1].forEach((v, i) => assert.ok(Math.abs(turned[i] - v) < 1e-12));
  assert.ok(Math.abs(angleBetween(X.q, q([0, 0, 1], 1.0)) - 0.3) < 1e-12);
  assert.ok(Math.abs(fixedAngles(Y.q)[0] + 1.2) < 1e-12);
});

test('the address of a camera that trembles about a round place stays the same', () => {
  const at = (x: number): string => hashOf({ camera: [x, -0.53124, 0, 1, 2, 3] });
  assert.equal(at(-0.0002), at(0.0002));
  assert.equal(at(0), 'camera=0.000+-0.531+0.000+1.000+2.000+3.000');
});

test('keys have one name each', () => {
  assert.equal(keyName({ key: ' ', shiftKey: false }), 'Space');
  assert.equal(keyName({ key: ' ', shiftKey: true }), 'Shift+Space');
  assert.equal(keyName({ key: 'F', shiftKey: true }), 'f');
  assert.equal(keyName({ key: '?', shiftKey: true }), '?');
  assert.equal(keyName({ key: 'ArrowLeft', shiftKey: true }), 'Shift+ArrowLeft');
});

test('fields are found by parts of their names', () => {
  const field = (column: string) => ({
    id: column,
    run: 'walk',
    table: 'poses',
    column,
    unit: 'm',
    name: column,
    words: `walk poses ${column}`,
  });
  const found = (query: string, ...columns: string[]) => matchFields(columns.map(field), query).map((f) => f.column);
  assert.deepEqual(found('FOOT m2', 'm1/foot.x', 'm2/foot.y'), ['m2/foot.y']);
  // What has the words as they are stands before what only has them within others.
  assert.deepEqual(found('foot y', 'm1/body_foot.x', 'm1/foot.y'), ['m1/foot.y', 'm1/body_foot.x']);
});

/** A run in which m1 has a role from `since` on, seconds, and waits in another line every tick, as programs that trace do. */
function traced(since: number, until: number): Run {
  const run = new Run('walk', 'log', 'A');
  for (let tick = 0; tick * 0.02 <= until; tick++) {
    const state = { module: 'm1', role: tick * 0.02 >= since ? 'Node' : '', labels: [], signs: [], tasks: [{ line: tick % 7 }] };
    run.takeState(tick * 0.02, state as any);
  }
  return run;
}

test('tasks that move on in every tick leave what is known of roles as it is', () => {
  const run = traced(0.2, 60);
  assert.equal(run.stateAt('m1', 0.1)?.role, '');
  assert.equal(run.stateAt('m1', 0.3)?.role, 'Node');
  // The last change of anything but tasks is that of the role.
  assert.equal(run.stateTime(Infinity), 0.2);
  assert.equal(run.stateAt('m1', 60)?.tasks[0].line, 3000 % 7);
});

test('who refused a question about roles is asked again a second later, and who answered is not', async () => {
  const run = traced(0, 1);
  let now = 0;
  let busy = true;
  let asked = 0;
  const questions = new RoleQuestions(
    async () => {
      asked++;
      if (busy) throw new Error('too many requests are under way');
      return { modules: { m1: [{ text: 'sizeof(self.connected) == 2', line: 3 }] } };
    },
    () => now,
  );
  const ask = async () => {
    questions.missing(run, 'm1', 1);
    await new Promise((resolve) => setImmediate(resolve));
    return questions.missing(run, 'm1', 1);
  };
  assert.equal(await ask(), null);
  assert.equal(asked, 1);
  busy = false;
  assert.equal(await ask(), null);
  assert.equal(asked, 1);
  now = 1000;
  assert.deepEqual(await ask(), [{ text: 'sizeof(self.connected) == 2', line: 3, holds: false }]);
  now = 5000;
  await ask();
  assert.equal(asked, 2);
});

test('what is said of one module or process at a time is kept for each of them', () => {
  const run = new Run('walk', 'log', 'A');
  const traces = (module: string, name: string) => ({ module, timestamp: { seconds: 1n, nanos: 0 }, fields: [{ name, value: 2 }] });
  takeMessage(run, 'traces', 1, traces('m1', 'best') as any);
  takeMessage(run, 'traces', 1, traces('m2', '') as any);
  assert.deepEqual([...run.newest.keys()], ['traces m1', 'traces m2']);
  assert.deepEqual(run.tables.get('traces m1')?.table.columnNames, ['best']);
  // A field without a name is of a program that is not known.
  assert.deepEqual(run.tables.get('traces m2')?.table.columnNames, []);
});

test('a plot that was never drawn has a time under every place', () => {
  const plot = new Plot({ getContext: () => ({}) } as any);
  for (const x of [-10, 0, 200, 1e6]) assert.ok(plot.clampedTimeAt(x) >= 0 && plot.clampedTimeAt(x) <= 1);
});

test('links that are small are boxes in the mean of their colours, and what is out of sight is not drawn', () => {
  // An octahedron: eight faces, half of whose area is white of its own.
  const at = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
  const corners = [1, -1].flatMap((x) => [1, -1].flatMap((y) => [1, -1].map((z) => [x > 0 ? 0 : 1, y > 0 ? 2 : 3, z > 0 ? 4 : 5])));
  const positions = new Float32Array(corners.flatMap((three) => three.flatMap((i) => at[i].map((v) => 0.05 * v))));
  const ownColours = new Float32Array(corners.flatMap((_, i) => [0, 1, 2].flatMap(() => (i < 4 ? [1, 1, 1, 1] : [0, 0, 0, 0]))));
  const batches = new LinkBatches();
  const geometry = batches.geometryOf({ positions, indices: null, ownColours });
  assert.equal(batches.geometryOf({ positions: positions.slice(), indices: null, ownColours: ownColours.slice() }), geometry);
  const camera = new PerspectiveCamera(40, 1, 0.02, 100);
  const drawn = (distance: number, place = new Vector3()): { small: number; fine: number; colour: number[] } => {
    camera.position.set(0, 0, distance);
    batches.begin();
    batches.add(geometry, new Matrix4().makeTranslation(place), new Color(1, 0, 0), sightOf(camera, 800, new Vector3()));
    batches.end();
    const [small, fine] = batches.group.children as Mesh[];
    const colour = small.geometry.getAttribute('color');
    return {
      small: small.visible ? small.geometry.drawRange.count / 3 : 0,
      fine: fine.visible ? 1 : 0,
      colour: colour ? [colour.getX(0), colour.getY(0), colour.getZ(0)] : [],
    };
  };
  // At 1 m the tenth of a metre is 110 pixels wide, at 5 m 22, at 20 m 5.
  assert.deepEqual(drawn(1), { small: 0, fine: 1, colour: [] });
  const few = drawn(5);
  assert.deepEqual([few.small, few.fine], [8, 0]);
  const box = drawn(20);
  assert.deepEqual([box.small, box.fine], [12, 0]);
  [1, 0.5, 0.5].forEach((c, i) => assert.ok(Math.abs(box.colour[i] - c) < 1e-6, `${box.colour}`));
  const { small, fine } = drawn(1, new Vector3(5, 0, 0));
  assert.deepEqual([small, fine], [0, 0]);
});
