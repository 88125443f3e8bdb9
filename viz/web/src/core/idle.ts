// Long times in which nothing happened, and an axis on which they take little room.

import type { RunEvent } from "#core/types.ts";

const LEAST_MS = 300_000; // the shortest idle time that is folded
const PART = 20; // it is folded if the rest is not this many times longer
const WIDTH = 44; // of a folded time [px]
const MOST = 1 / 3; // part of the axis that folded times may take

/** [ms] */
export type Idle = { from: number; to: number };

/** The idle times of a run that leave too little room for the rest, in their order. */
export function idleIn(events: RunEvent[]): Idle[] {
  const long: Idle[] = [];
  for (let i = 1; i < events.length; i++) {
    const [from, to] = [events[i - 1].stamp_ns / 1e6, events[i].stamp_ns / 1e6];
    if (to - from >= LEAST_MS) long.push({ from, to });
  }
  long.sort((a, b) => lengthOf(b) - lengthOf(a));
  let rest = events.length ? (events[events.length - 1].stamp_ns - events[0].stamp_ns) / 1e6 : 0;
  const found: Idle[] = [];
  for (const one of long) {
    if (lengthOf(one) * PART < rest) break;
    rest -= lengthOf(one);
    found.push(one);
  }
  return found.sort((a, b) => a.from - b.from);
}

export const lengthOf = ({ from, to }: Idle) => to - from;

/** Where the instants of a range are between two places, if some idle times are folded. */
export class Axis {
  readonly from: number; // [ms]
  readonly to: number;
  readonly left: number; // [px]
  readonly right: number;
  readonly folds: Idle[]; // those in the range
  readonly rate: number; // [px/ms], but for folded times
  #width = 0; // of a folded time [px]

  /** @param folds do not overlap, in their order */
  constructor(folds: Idle[], { from, to }: Idle, left: number, right: number) {
    [this.from, this.to, this.left, this.right] = [from, to, left, right];
    this.folds = folds.filter((one) => one.from < to && one.to > from && !(one.from <= from && one.to >= to));
    const inside = this.folds.map((one) => Math.min(one.to, to) - Math.max(one.from, from));
    const parts = this.folds.reduce((sum, one, i) => sum + inside[i] / lengthOf(one), 0);
    const busy = to - from - inside.reduce((a, b) => a + b, 0);
    if (parts) this.#width = Math.min(WIDTH, ((right - left) * MOST) / parts);
    this.rate = (right - left - parts * this.#width) / Math.max(busy, 1e-6);
  }

  /** The place of an instant; outside of the range, too. */
  x(t: number) {
    let busy = t - this.from;
    let parts = 0;
    for (const fold of this.folds) {
      const folded = Math.min(Math.max(t, fold.from), fold.to) - Math.min(Math.max(this.from, fold.from), fold.to);
      busy -= folded;
      parts += folded / lengthOf(fold);
    }
    return this.left + busy * this.rate + parts * this.#width;
  }

  /** The instant at a place; outside of the range, too. */
  timeAt(px: number) {
    let [t, at] = [this.from, this.left];
    for (const { from, to } of this.folds) {
      const [begin, end] = [this.x(from), this.x(to)];
      if (px < begin) return from - (begin - px) / this.rate;
      if (px <= end) return from + ((px - begin) / (end - begin)) * (to - from);
      [t, at] = [to, end];
    }
    return t + (px - at) / this.rate;
  }

  /** The folded time at a place; null for none. */
  foldAt(px: number) {
    return this.folds.find(({ from, to }) => px >= this.x(from) && px <= this.x(to)) ?? null;
  }
}
