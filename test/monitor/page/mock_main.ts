/** The page on a mock server, for looking at it and for tests of its states: MOCK in the URL's query says which. */
import { App } from '../src/app.ts';
import { MockServer, type MockSource } from './mock_server.ts';
import descriptors from '../schemas/monitor.bin';

const CASES: Record<string, MockSource[]> = {
  none: [],
  live: [{ name: 'walk', kind: 'live', robot: 'row', modules: 5 }],
  large: [{ name: 'many', kind: 'log', robot: 'row', modules: 300, seconds: 2 }],
  late: [
    { name: 'walk-past', kind: 'log', robot: 'row', modules: 3, seconds: 4, pastOf: 'walk' },
    { name: 'walk', kind: 'live', robot: 'row', modules: 3 },
  ],
  cut: [
    {
      ...{ name: 'torn', kind: 'log', robot: 'row', modules: 3, seconds: 15.18 },
      damage: { cut: true, time_us: 15_180_000, what: 'an event has no end' },
    },
  ],
  two: [
    { name: 'first', kind: 'log', robot: 'row', modules: 4, seconds: 20 },
    { name: 'second', kind: 'log', robot: 'other_row', modules: 4, seconds: 20, astray: 0.004, mirrored: true },
  ],
};

const server = new MockServer(descriptors, CASES[new URLSearchParams(location.search).get('case') ?? 'live'], true);
const root = document.getElementById('app');
if (root) {
  const app = new App(root, {
    open: () => server.open(),
    timer: (seconds, action) => {
      const id = setTimeout(action, seconds * 1000);
      return () => clearTimeout(id);
    },
  });
  Object.assign(window, { monitor: app, server });
  app.start();
}
