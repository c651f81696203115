/** Why modules have a role or none, as the server finds it: asked when it is wanted, and kept as long as nothing changes. */

import type { Decoded } from '../protocol/decoder.ts';
import type { Run } from './run.ts';

/** A thing that a role asks for, and the line of the program that does; 0 for none. */
export interface RoleFinding {
  text: string;
  /** The program, or what it imports. */
  file: string;
  line: number;
  /** Whether the module has it. */
  holds: boolean;
}

/** Answers that are kept. */
const KEPT = 100;
/** After this time a question that was refused is asked again, ms: a server may have too much to do. */
const RETRY = 1000;

export class RoleQuestions {
  /** By question: the answer; null while it is asked, or has been refused. */
  private readonly answers = new Map<string, Decoded | null>();
  /** By question that was refused: when it may be asked again, on the clock of `now`. */
  private readonly retries = new Map<string, number>();
  /** Grows with what is known. */
  version = 0;

  /**
   * @param call asks the server, by the service's name.
   * @param now a clock, ms.
   */
  constructor(
    private readonly call: (run: Run, service: string, request: unknown) => Promise<Decoded>,
    private readonly now: () => number = () => performance.now(),
  ) {}

  /** What a module without a role lacks at a time, one for each role; null as long as nothing is known. Asks if nobody has. */
  missing(run: Run, module: string, time: number): RoleFinding[] | null {
    const answer = this.answer(run, 'missing_roles', {}, time);
    return answer?.modules?.[module]?.map((lack: any) => ({ ...lack, holds: false })) ?? null;
  }

  /** What a role asks of a module, and what it finds there; likewise. */
  why(run: Run, module: string, role: string, time: number): RoleFinding[] | null {
    const answer = this.answer(run, 'explain_role', { module, role }, time);
    if (!answer) return null;
    if (answer.lacks) return [{ text: `its type has no ${answer.lacks}`, file: answer.file, line: answer.line, holds: false }];
    return answer.parts.map(({ label, file, line, holds, finding }: any) => ({
      text: label ? `label ${label} ${finding}` : `requirement ${finding}`,
      file,
      line,
      holds,
    }));
  }

  clear(): void {
    this.answers.clear();
    this.retries.clear();
  }

  private answer(run: Run, service: string, request: Record<string, string>, time: number): Decoded | null {
    const since = run.stateTime(time);
    if (Number.isNaN(since)) return null;
    const key = JSON.stringify([run.name, service, request, since]);
    const known = this.answers.get(key);
    const again = this.now() >= (this.retries.get(key) ?? Infinity);
    // Of a run only the present can be asked for.
    if ((known === undefined || again) && (run.kind === 'log' || since === run.stateTime(Infinity)))
      this.ask(key, run, service, { ...request, time_us: Math.round(since * 1e6) });
    return known ?? null;
  }

  private ask(key: string, run: Run, service: string, request: unknown): void {
    this.answers.set(key, null);
    this.retries.delete(key);
    if (this.answers.size > KEPT) {
      const oldest = [...this.answers.keys()][0];
      this.answers.delete(oldest);
      this.retries.delete(oldest);
    }
    this.call(run, service, request)
      .then((answer) => {
        this.answers.set(key, answer);
        this.version++;
      })
      .catch(() => {
        this.retries.set(key, this.now() + RETRY);
      });
  }
}
