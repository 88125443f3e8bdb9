// How instants are told, everywhere on the page, and which idle times take little room.

import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import { type Idle, idleIn } from "#core/idle.ts";
import { save, saved } from "#core/storage.ts";
import type { Data } from "#core/store/data.ts";
import type { Playback } from "#core/store/playback.ts";

export type ClockName = "run" | "wall" | "relative";
export const CLOCKS: ClockName[] = ["run", "wall", "relative"];

export class Clock {
  readonly chosen: Signal<ClockName> = signal(saved<ClockName>("clock", "run"));
  /** Whether idle times are folded; those that the user unfolded are not, by their beginnings [ms]. */
  readonly foldsIdle = signal(true);
  readonly unfolded: Signal<ReadonlySet<number>> = signal(new Set());
  #idle: { key: string; found: Idle[] } = { key: "", found: [] };
  #data: Data;
  #playback: Playback;

  constructor(data: Data, playback: Playback) {
    this.#data = data;
    this.#playback = playback;
  }

  choose(name: ClockName) {
    this.chosen.value = name;
    save("clock", name);
    this.#playback.updateSlow();
  }

  /** The idle times of the run. */
  idle() {
    const { events } = this.#data.run;
    const key = `${this.#data.facts.value?.epoch} ${events[0]?.seq} ${events.at(-1)?.seq}`;
    if (key !== this.#idle.key) this.#idle = { key, found: idleIn(events) };
    return this.#idle.found;
  }

  /** Those that are folded. */
  folds() {
    return this.foldsIdle.value ? this.idle().filter(({ from }) => !this.unfolded.value.has(from)) : [];
  }

  /** Fold all idle times, or none. */
  foldIdle(folds: boolean) {
    this.unfolded.value = new Set();
    this.foldsIdle.value = folds;
  }

  unfold({ from }: Idle) {
    this.unfolded.value = new Set([...this.unfolded.value, from]);
  }

  /** An instant by the chosen clock: 00:32.0 since the run began, 10:42:59 of the day, or -12.3 s from now. */
  instantText(t: number, digits: number = 1) {
    if (this.chosen.value === "wall") return wallText(t, digits);
    if (this.chosen.value !== "relative") return this.runText(t, digits);
    const live = this.#data.liveMs();
    const seconds = (t - live) / 1000;
    return Math.abs(seconds) < 60 ? `${seconds.toFixed(digits)} s` : this.runText(t, digits, live);
  }

  /** An instant as time since another one, by default the beginning of the run, such as 00:32.0. */
  runText(t: number, digits: number = 1, since = this.#playback.began() ?? t) {
    const seconds = (t - since) / 1000;
    const unit = 10 ** digits; // in a second
    const all = Math.round(Math.abs(seconds) * unit);
    const two = (n: number) => String(Math.floor(n)).padStart(2, "0");
    const hours = Math.floor(all / (3600 * unit));
    const part = digits ? `.${String(all % unit).padStart(digits, "0")}` : "";
    const minutes = `${two((all / unit / 60) % 60)}:${two((all / unit) % 60)}${part}`;
    return `${seconds < 0 && all ? "-" : ""}${hours ? `${hours}:` : ""}${minutes}`;
  }
}

function wallText(t: number, digits: number) {
  const unit = 10 ** digits;
  const rounded = new Date(Math.round((t * unit) / 1000) * (1000 / unit));
  const part = digits ? `.${String(Math.round(rounded.getMilliseconds() * (unit / 1000))).padStart(digits, "0")}` : "";
  return `${rounded.toLocaleTimeString("en-GB", { hour12: false })}${part}`;
}
