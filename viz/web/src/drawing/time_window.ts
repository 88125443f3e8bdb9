// The part of the run that the timeline shows: a range of a length that ends at an instant, or moves on with the
// present.

import { Axis, lengthOf } from "#core/idle.ts";
import { store } from "#core/store.ts";

const LIVE_MS = 30_000; // shown at first
export const SHORTEST_MS = 20; // the shortest time that can fill the timeline
const LONGEST_MS = 30 * 86_400_000;
const WIDE = 1000; // about the width of the timeline [px]

export class TimeWindow {
  length = LIVE_MS; // [ms]
  end: number | null = null; // [ms]; null: now

  reset() {
    this.end = null;
    this.length = LIVE_MS;
  }

  /** Show the whole run. */
  fitAll() {
    const first = store.data.run.first();
    const last = store.playback.nowMs();
    if (first == null) return;
    const folded = store.clock.folds().reduce((sum, one) => sum + lengthOf(one), 0);
    const margin = (last - first - folded) * 0.02;
    this.length = Math.max(SHORTEST_MS, last - first + 2 * margin);
    this.end = Math.max(last + margin, first + this.length * 0.98);
  }

  /** Show a visit with some time around it. @param to [ms] */
  fit(from: number, to: number) {
    this.length = Math.max(SHORTEST_MS, (to - from) * 1.1);
    this.end = (from + to) / 2 + this.length / 2;
  }

  /** Show a range [ms]; one that reaches the present of a running machine moves on with it. */
  show({ from, to }: { from: number; to: number }) {
    const { playback, data } = store;
    const isLive = playback.cursor.value === null && playback.goes.value && to >= data.liveMs();
    this.length = Math.max(SHORTEST_MS, to - from);
    this.end = isLive ? null : to;
  }

  /** The range [ms]. */
  range(): [number, number] {
    const now = store.playback.nowMs();
    const isPast = store.playback.cursor.value !== null;
    let end = this.end ?? now + this.length * 0.01;
    if (this.end === null && isPast) end = now + this.length / 2;
    const first = store.data.run.first(); // a run shorter than the range begins at the left
    if (this.end === null && !isPast && first != null) end = Math.max(end, first + this.length * 0.98);
    return [end - this.length, end];
  }

  /** Where the instants of the range are between two places. */
  axis(left: number, right: number) {
    const [from, to] = this.range();
    return new Axis(store.clock.folds(), { from, to }, left, right);
  }

  /** Let the range stay where it is. */
  hold() {
    this.end ??= this.range()[1];
  }

  /** Move the range by a part of what it shows. */
  move(part: number) {
    const axis = this.axis(0, WIDE);
    const [from, to] = [part * WIDE, (1 + part) * WIDE].map((px) => axis.timeAt(px));
    this.length = Math.max(SHORTEST_MS, to - from);
    this.end = to;
  }

  /** Make the range longer by a factor, around an instant [ms]. */
  zoom(factor: number, at: number) {
    const axis = this.axis(0, WIDE);
    const isHeld = this.end !== null || store.playback.cursor.value !== null;
    const fixed = isHeld ? axis.x(at) : WIDE; // the present stays where it is
    const [from, to] = [0, WIDE].map((px) => axis.timeAt(fixed + (px - fixed) * factor));
    const length = Math.max(SHORTEST_MS, Math.min(to - from, LONGEST_MS));
    if (isHeld) this.end = length === to - from ? to : at + ((to - at) * length) / (to - from);
    this.length = length;
  }

  /** Keep the played instant in view. */
  keepInView() {
    const at = store.playback.cursor.value;
    if (this.end === null || at === null || !store.playback.playing.value) return;
    if (at > this.end - 0.02 * this.length) this.end = at + 0.8 * this.length;
    else if (at < this.end - this.length) this.end = at + 0.95 * this.length;
  }
}
