// Numbers in the diagram: of the run shown, of recorded runs, or of both compared.
// Counted as in viz/smachpy_viz/runs/statistics.py; tests/data/statistics.json has examples for both.

import { own } from "#core/fold.ts";
import type { Model } from "#core/model.ts";
import { duration } from "#core/text.ts";
import type { StateRun, StateStatistics, Statistics } from "#core/types.ts";

export const MODES: [string, string][] = [
  ["none", "No numbers"],
  ["counts", "Counts of this run"],
  ["time", "Time in this run"],
  ["runs", "Recorded runs"],
  ["failures", "Failures in recorded runs"],
  ["compare", "This run against recorded runs"],
];
export const OF_RECORDED_RUNS = ["runs", "failures", "compare"];

export type Outcomes = Record<string, number> | null | undefined;

const total = (outcomes: Outcomes) => Object.values(outcomes ?? {}).reduce((a, b) => a + b, 0);

/** of a transition */
export type CountOf = (path: string, outcome: string) => { count: number; share: number } | null;
/** of a state, 0 to 1 */
export type HeatOf = (path: string) => number;

/**
 * The counts of transitions and the heat of states for `Diagram.showNumbers` in a mode.
 * @param run the states of the run shown
 * @param statistics of recorded runs
 */
export function numbersFor(
  mode: string,
  run: Record<string, StateRun>,
  statistics: Statistics | null,
  model: Model | null,
): { countOf: CountOf | null; heatOf: HeatOf | null } {
  const recorded = statistics?.states ?? {};
  const counts: (states: Record<string, { outcomes: Record<string, number> }>) => CountOf =
    (states) => (path, outcome) => {
      const outcomes = own(states, path)?.outcomes;
      const count = own(outcomes, outcome);
      return count ? { count, share: count / total(outcomes) } : null;
    };
  switch (mode) {
    case "counts":
      return { countOf: counts(run), heatOf: null };
    case "time": {
      const most = mostSeconds(run, model);
      return { countOf: counts(run), heatOf: (path) => Math.min(1, (own(run, path)?.seconds ?? 0) / most) };
    }
    case "runs":
      return { countOf: counts(recorded), heatOf: null };
    case "failures":
      return { countOf: counts(recorded), heatOf: (path) => own(recorded, path)?.failures ?? 0 };
    case "compare":
      return { countOf: counts(run), heatOf: (path) => slower(own(run, path), own(recorded, path)) };
    default:
      return { countOf: null, heatOf: null };
  }
}

/** The longest time spent in a leaf [s]. */
function mostSeconds(run: Record<string, StateRun>, model: Model | null) {
  const leaves = Object.entries(run).filter(([path]) => !model?.get(path)?.children.length);
  return Math.max(0.001, ...leaves.map(([, state]) => state.seconds));
}

/** The texts at the cold and the hot end of a mode's scale; null if it has no heat. */
export function heatScale(mode: string, run: Record<string, StateRun>, model: Model | null): [string, string] | null {
  switch (mode) {
    case "time":
      return ["0 s", duration(mostSeconds(run, model))];
    case "failures":
      return ["none failed", "all failed"];
    case "compare":
      return ["as usual", "twice as long"];
    default:
      return null;
  }
}

/** How much longer a state takes than the median of recorded runs: 0 not longer, 1 twice as long or more. */
function slower(state: StateRun | undefined, recorded: StateStatistics | undefined) {
  if (!state || !recorded?.median) return 0;
  const ended = total(state.outcomes);
  return ended ? Math.min(1, Math.max(0, state.seconds / ended / recorded.median - 1)) : 0;
}

/** The number of explicit transitions that were taken, and of all. */
export function coverage(model: Model | null, run: Record<string, StateRun>) {
  let taken = 0;
  let all = 0;
  for (const node of model?.order ?? [])
    for (const edge of node.edges) {
      if (edge.implicit) continue;
      for (const outcome of edge.outcomes) {
        all += 1;
        if (own(own(run, `${node.path}/${edge.source}`)?.outcomes, outcome)) taken += 1;
      }
    }
  return { taken, all };
}
