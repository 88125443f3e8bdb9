// Data that Python's tests share (tests/viz/live/test_page_fixtures.py).
import { readFileSync } from "node:fs";
import type { MachineFacts, RunEvent } from "#core/types.ts";

export const fixture = (name: string): any => JSON.parse(readFileSync(`../../tests/data/${name}`, "utf-8"));

export const FACTS: MachineFacts = {
  name: "one",
  label: "PATROL",
  epoch: "1",
  revision: 1,
  stale: null,
  control: null,
  recorded: false,
  node: "",
  behind: null,
  before: null,
  after: null,
  refused: 0,
  refusal: "",
  noted: 0,
};

let seq = 0;
/** An event, a second after the one before. */
export function event(kind: string, path: string, facts: object = {}) {
  seq += 1;
  return { kind, path, seq, t: 0, stamp_ns: seq * 1e9, ...facts } as RunEvent;
}

/** Seconds that were added up differ in the last digits. */
export const rounded = (state: any) =>
  JSON.parse(JSON.stringify(state), (key, value) => (key === "seconds" ? Number(value.toFixed(6)) : value));

/** Timers that run only when a test lets time pass. */
export class Clock {
  now = 1e6; // [ms]
  due: Map<number, { at: number; every: number | null; run: () => void }> = new Map();
  #ids = 0;

  /** Take the place of the timers of the program. */
  install() {
    const add =
      (repeats: boolean) =>
      (run: () => void, pause = 0) => {
        this.#ids += 1;
        this.due.set(this.#ids, { at: this.now + pause, every: repeats ? pause : null, run });
        return this.#ids;
      };
    const remove = (id: number) => this.due.delete(id);
    Object.assign(globalThis, { setTimeout: add(false), setInterval: add(true) });
    Object.assign(globalThis, { clearTimeout: remove, clearInterval: remove });
    Date.now = () => this.now;
  }

  /** @param time [ms] */
  pass(time: number) {
    const end = this.now + time;
    for (;;) {
      const [next] = [...this.due].filter(([, { at }]) => at <= end).sort(([, a], [, b]) => a.at - b.at);
      if (!next) break;
      const [id, timer] = next;
      this.now = timer.at;
      if (timer.every === null) this.due.delete(id);
      else timer.at += timer.every;
      timer.run();
    }
    this.now = end;
  }
}
