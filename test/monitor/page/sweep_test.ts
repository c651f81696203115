import assert from 'node:assert/strict';
import { test } from 'node:test';
import { binned, candidatesOf, cellsOf, distinct, effectOf, frontOf, improvementsOf, isNumeric, ordered, seriesOf, valueText, type Series, type Sweep } from '../src/sweep/data.ts';

const sweep: Sweep = {
  columns: [
    { name: 'friction', kind: 'input' },
    { name: 'robot', kind: 'input' },
    { name: 'height', kind: 'figure' },
  ],
  rows: [
    { row: 1, status: 'done', error: '', goal: 3, goals: [], allowed: true, values: [0.8, 'snake', 1] },
    { row: 2, status: 'done', error: '', goal: 1, goals: [], allowed: true, values: [0.4, 'worm', 2] },
    { row: 3, status: 'failed', error: 'why', goal: null, goals: [], allowed: true, values: [0.8, 'worm', null] },
    { row: 4, status: 'done', error: '', goal: 5, goals: [], allowed: true, values: [0.8, 'snake', 4] },
  ],
  goal: 'height + 1',
  smallest: false,
  search: [],
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

test('of a search the improvements are told, and the front, of what its conditions allow', () => {
  const tried = (goals: (number | null)[], allowed = true) => ({ row: 1, status: 'done', error: '', goal: 0, goals, allowed, values: [] });
  const search: Sweep = {
    ...sweep,
    search: [
      { text: 'speed', smallest: false },
      { text: 'energy', smallest: true },
    ],
    rows: [tried([1, 5]), tried([9, 1], false), tried([3, 9]), tried([2, 6]), tried([null, 1]), tried([4, 9]), tried([1, 7])],
  };
  assert.deepEqual(candidatesOf(search), [0, 2, 3, 5, 6]);
  assert.deepEqual(improvementsOf(search, 0), [0, 2, 5]);
  assert.deepEqual(improvementsOf(search, 1), [0]);
  assert.deepEqual(frontOf(search, [0, 1]), [5, 3, 0]);
});

test('very many numbers are put together by parts of their range', () => {
  const few: Series = { name: 'few', input: true, values: [1, 2, null, 2] };
  assert.equal(binned(few), few);
  const many: Series = { name: 'many', input: true, values: [...Array(121).keys(), null] };
  const parts = binned(many);
  assert.deepEqual(distinct(parts), [5, 15, 25, 35, 45, 55, 65, 75, 85, 95, 105, 115]);
  assert.deepEqual([0, 9, 10, 120, 121].map((row) => parts.values[row]), [5, 5, 15, 115, null]);
});
