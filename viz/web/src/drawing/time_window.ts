// The part of the run that the timeline shows: a range of a length that ends at an instant, or moves on with the
// present.

import { store } from "#core/store.ts";

const LIVE_MS = 30_000; // shown at first
const SHORTEST_MS = 200; // the shortest time that can fill the timeline
const LONGEST_MS = 30 * 86_400_000;

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
    this.length = Math.max(500, (last - first) * 1.04);
    this.end = last + this.length * 0.02;
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

  /** Let the range stay where it is. */
  hold() {
    this.end ??= this.range()[1];
  }

  /** Move the range. @param time [ms] */
  move(time: number) {
    this.end = this.range()[1] + time;
  }

  /** Make the range longer by a factor, around an instant [ms]. */
  zoom(factor: number, at: number) {
    const [, to] = this.range();
    const length = Math.max(SHORTEST_MS, Math.min(this.length * factor, LONGEST_MS));
    if (this.end !== null || store.playback.cursor.value !== null) this.end = at + ((to - at) * length) / this.length;
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
