import assert from 'node:assert/strict';
import { test } from 'node:test';
import { cellsOf, distinct, effectOf, isNumeric, ordered, seriesOf, valueText, type Series, type Sweep } from '../src/sweep/data.ts';

const sweep: Sweep = {
  columns: [
    { name: 'friction', kind: 'input' },
    { name: 'robot', kind: 'input' },
    { name: 'height', kind: 'figure' },
  ],
  rows: [
    { row: 1, status: 'done', error: '', goal: 3, values: [0.8, 'snake', 1] },
    { row: 2, status: 'done', error: '', goal: 1, values: [0.4, 'worm', 2] },
    { row: 3, status: 'failed', error: 'why', goal: null, values: [0.8, 'worm', null] },
    { row: 4, status: 'done', error: '', goal: 5, values: [0.8, 'snake', 4] },
  ],
  goal: 'height + 1',
  smallest: false,
  rerun: 'morphbus sweep rerun x.db ',
};

function series(name: string): Series {
  return seriesOf(sweep).find((one) => one.name === name) as Series;
}

test('the goal stands behind the inputs, unless it is a figure itself', () => {
  assert.deepEqual(seriesOf(sweep).map((one) => one.name), ['friction', 'robot', 'height + 1', 'height']);
  assert.deepEqual(seriesOf({ ...sweep, goal: 'height' }).map((one) => one.name), ['friction', 'robot', 'height']);
});

test('values are told apart, numbers by size', () => {
  assert.deepEqual(distinct(series('friction')), [0.4, 0.8]);
  assert.deepEqual(distinct(series('robot')), ['snake', 'worm']);
  assert.ok(isNumeric(series('height')) && !isNumeric(series('robot')));
  assert.equal(valueText(0.123456789), '0.12346');
  assert.equal(valueText(null), '–');
});

test('a cell has the mean of its rows, and none stands for what is not known', () => {
  const cells = cellsOf(series('friction'), series('robot'), series('height'), [0, 1, 2, 3]);
  assert.deepEqual(cells, [
    { x: 1, y: 0, mean: 2.5, count: 2 },
    { x: 0, y: 1, mean: 2, count: 1 },
  ]);
});

test('an input that decides all has an effect of 1, and one that decides nothing of 0', () => {
  const of = (values: number[]): Series => ({ name: '', input: true, values });
  const figure = of([1, 1, 5, 5]);
  assert.equal(effectOf(of([0, 0, 1, 1]), figure, [0, 1, 2, 3]), 1);
  assert.equal(effectOf(of([0, 1, 0, 1]), figure, [0, 1, 2, 3]), 0);
  assert.equal(effectOf(of([0, 1, 0, 1]), of([2, 2, 2, 2]), [0, 1, 2, 3]), 0);
});

test('rows are sorted, unknown ones last and equal ones as they were', () => {
  assert.deepEqual(ordered(series('height'), [0, 1, 2, 3], false), [0, 1, 3, 2]);
  assert.deepEqual(ordered(series('height'), [0, 1, 2, 3], true), [3, 1, 0, 2]);
  assert.deepEqual(ordered(series('robot'), [3, 2, 1, 0], false), [3, 0, 2, 1]);
});
