/**
 * Who answers to whom in two runs. The server matches them by the rule of `morphbus compare` (role and label, signs of the
 * conventions); here is only what it says, and the values that follow from it.
 */

import { toNumber, type Decoded } from '../protocol/decoder.ts';

/** From when on (sim time, seconds) by what values are multiplied; the first holds before its time, too. */
type Signs = { since: number; sign: number }[];

/** A joint or link of run A and the one of B that answers to it. */
export interface Pair {
  /** "FrontLeftLowerHalf.knee"; with A's module behind it where several modules have that role. */
  name: string;
  role: string;
  kind: 'joint' | 'link';
  /** Whether both runs have resolved the label; else it is the part's name in A. */
  labelled: boolean;
  moduleA: string;
  moduleB: string;
  /** Names of the joint or link. */
  partA: string;
  partB: string;
  /** Of joints; none for links. */
  signsA: Signs;
  signsB: Signs;
}

function signs(spans: readonly any[]): Signs {
  return spans.map((span) => ({ since: toNumber(span.sinceUs) * 1e-6, sign: span.sign }));
}

/** The pairs of a message morphbus.Pairs. */
export function pairsIn(message: Decoded): Pair[] {
  const roles = message.modules.map((m: any) => m.role);
  return message.modules.flatMap((m: any): Pair[] => {
    const several = roles.filter((role: string) => role === m.role).length > 1;
    const shared = { role: m.role, moduleA: m.moduleA, moduleB: m.moduleB };
    const nameOf = (part: string): string => `${m.role || m.moduleA}.${part}${several ? ` (${m.moduleA})` : ''}`;
    return [
      ...m.joints.map((j: any) => ({
        ...shared,
        name: nameOf(j.label),
        kind: 'joint',
        labelled: j.labelled,
        partA: j.jointA,
        partB: j.jointB,
        signsA: signs(j.signsA),
        signsB: signs(j.signsB),
      })),
      ...m.links.map((l: any) => ({
        ...shared,
        name: nameOf(l.label || l.linkA),
        kind: 'link',
        labelled: l.labelled,
        partA: l.linkA,
        partB: l.linkB,
        signsA: [],
        signsB: [],
      })),
    ];
  });
}

/** By what a value of that time is multiplied. */
export function signAt(spans: Signs, time: number): number {
  let sign = spans[0]?.sign ?? 1;
  for (const span of spans) if (span.since <= time + 1e-9) sign = span.sign;
  return sign;
}
