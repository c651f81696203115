// Runs, logs and monitors for the tests in a browser; each test file has a registry of runs of its own.
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';

const MORPHBUS = join(process.env.MORPHBUS_BIN, 'morphbus');
export const MODEL = join(process.env.MORPHBUS_SOURCE, 'models/mtran.m3l');
export const PROGRAM = join(process.env.MORPHBUS_SOURCE, 'models/programs/quadruped.dyn');
export const TOKEN = 'token-of-the-tests';

/** A folder for files and for the registry of runs, and the processes that were started from it. */
export class Demo {
  constructor() {
    this.folder = mkdtempSync(join(tmpdir(), 'morphbus-page-'));
    mkdirSync(join(this.folder, 'runtime'), { mode: 0o700 });
    this.environment = { ...process.env, XDG_RUNTIME_DIR: join(this.folder, 'runtime') };
    delete this.environment.LCM_DEFAULT_URL;
    this.processes = [];
  }

  /** Runs a command to its end and returns what it says as JSON. */
  json(...words) {
    return JSON.parse(
      execFileSync(MORPHBUS, [...words, '--json'], {
        env: this.environment,
        encoding: 'utf8',
        stdio: ['ignore', 'pipe', 'inherit'],
      }),
    );
  }

  start(...words) {
    const child = spawn(MORPHBUS, words, { env: this.environment, stdio: ['ignore', 'pipe', 'pipe'] });
    child.said = '';
    child.stderr.on('data', (data) => (child.said += data));
    child.ended = new Promise((resolve) => child.on('exit', resolve));
    this.processes.push(child);
    return child;
  }

  /** Records a run as fast as it goes; returns the log's path. */
  record(robot, run, seconds) {
    const path = join(this.folder, `${run}.log`);
    this.json(
      'run',
      MODEL,
      PROGRAM,
      '--robot',
      robot,
      '--run',
      run,
      '--seconds',
      String(seconds),
      '--inproc',
      '--log',
      path,
    );
    return path;
  }

  /**
   * A log of a row of modules that all wave, in the air and with nothing that weighs: it would break. Where they are they
   * learn from each other, one a tick.
   */
  recordRow(modules, seconds) {
    const [model, program, log] = ['row.m3l', 'wave.dyn', 'row.log'].map((name) => join(this.folder, name));
    const names = Array.from({ length: modules }, (_, i) => `m${i}`);
    const pairs = names.slice(1).map((name, i) => `(${names[i]}.c2, ${name}.c5)`);
    writeFileSync(
      model,
      `import "${MODEL}"\nrobot row: modules=(${names.map((name) => `MTRAN ${name}`).join()}), connections=(${pairs.join()})\n`,
    );
    writeFileSync(
      program,
      `role Wave extends Module {
  behavior wave() {
    self.JOINT_1.SET_POSITION(20);
    self.sleepds(3);
    self.JOINT_1.SET_POSITION(-20);
    self.sleepds(3);
  }
}
`,
    );
    const options = ['--robot', 'row', '--seconds', String(seconds), '--inproc', '--still', '--log', log];
    this.json('run', model, program, ...options);
    return log;
  }

  /** Starts a live run in a network of its own, in lockstep, and has it do this command as soon as it takes any. */
  async run(robot, run, ...words) {
    const log = join(this.folder, `${run}.log`);
    const options = ['--robot', robot, '--run', run, '--isolate', '--seconds', '3000', '--log', log, '--json'];
    const child = this.start('run', MODEL, PROGRAM, ...options);
    for (const limit = Date.now() + 120_000; ;) {
      try {
        this.control(run, ...words);
        return child;
      } catch (error) {
        // It takes commands only once all its processes are there.
        if (Date.now() > limit || child.exitCode !== null) throw new Error(`${error.stderr ?? error}\n${child.said}`);
        await new Promise((resolve) => setTimeout(resolve, 50));
      }
    }
  }

  control(run, ...words) {
    return JSON.parse(
      execFileSync(MORPHBUS, ['control', ...words, '--run', run, '--json'], {
        env: this.environment,
        encoding: 'utf8',
        stdio: ['ignore', 'pipe', 'pipe'],
      }),
    );
  }

  /** Starts a monitor and returns where to look: `url`, `port`. */
  async monitor(words, port = 0) {
    const child = this.start('monitor', ...words, '--port', String(port), '--token', TOKEN, '--json');
    const line = await new Promise((resolve, reject) => {
      createInterface({ input: child.stdout }).once('line', resolve);
      child.ended.then(() => reject(new Error(`the monitor ended: ${child.said}`)));
    });
    return { ...JSON.parse(line), process: child };
  }

  async stop(child, signal = 'SIGINT') {
    child.kill(signal);
    await child.ended;
  }

  async end() {
    for (const child of this.processes) if (child.exitCode === null) await this.stop(child);
    rmSync(this.folder, { recursive: true, force: true });
  }
}
