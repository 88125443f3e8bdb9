// Batches of simulated runs: their start and progress.

import type { Batch } from "#core/types.ts";
export type Form = { mission: string; runs: string; vary: string; seed: string; limit: string; compare: string };

const WHOLE = /^\s*-?\d{1,9}\s*$/;

/** The request for a form's values, or the problems with them; the server checks everything again. */
export function startOf({ mission, runs, vary, seed, limit, compare }: Form) {
  const problems = [
    mission ? "" : "mission: got none; expected one",
    WHOLE.test(runs) && Number(runs) >= 1 ? "" : `runs: got ${runs || "nothing"}; expected a whole number from 1 on`,
    WHOLE.test(seed) ? "" : `seed: got ${seed || "nothing"}; expected a whole number`,
  ].filter(Boolean);
  const lines = vary
    .split("\n")
    .map((line) => line.trim())
    .filter(Boolean);
  const asked = { command: "start", mission, runs: Number(runs), vary: lines, seed: Number(seed), limit, compare };
  return { asked: problems.length ? null : asked, problem: problems.join("; ") };
}

/** The number of ended runs. */
export const doneOf = ({ outcomes, failed }: Batch) =>
  Object.values(outcomes).reduce((sum, count) => sum + count, failed);
