// The whole run in a strip: how much happened when, and what went wrong.

import type { Model } from "#core/model.ts";
import { endClass } from "#core/outcomes.ts";
import type { RunEvent, Wait } from "#core/types.ts";

export type Density = {
  counts: number[]; // events by column
  failures: number[]; // instants [ms]
  preempts: number[];
  starts: number[]; // of runs, but for the first one
};

/**
 * @param columnOf the column of an instant [ms], from 0
 * @param columns number of columns
 * @param model knows which states are monitors, whose own ends are no failures
 */
export function densityOf(
  events: RunEvent[],
  columnOf: (t: number) => number,
  columns: number,
  model: Model | null = null,
): Density {
  const found: Density = { counts: new Array(columns).fill(0), failures: [], preempts: [], starts: [] };
  let begun = false;
  for (const e of events) {
    const t = e.stamp_ns / 1e6;
    found.counts[Math.max(0, Math.min(columns - 1, Math.floor(columnOf(t))))] += 1;
    const isFailure =
      e.kind === "Failed" || (e.kind === "Left" && endClass(model?.get(e.path), e.outcome) === "failure");
    if (isFailure) found.failures.push(t);
    else if (e.kind === "PreemptRequested") found.preempts.push(t);
    else if (e.kind === "Started") {
      if (begun) found.starts.push(t);
      begun = true;
    }
  }
  return found;
}

/** The part of a time in which somebody was asked. @param now end of a wait that goes on [ms] */
export const asksIn = (waits: Wait[], now: number): [number, number][] =>
  waits.filter(({ kind }) => kind === "asks").map(({ from, to }) => [from, to ?? now]);
