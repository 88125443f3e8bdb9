// Batches of simulated runs: what is asked for, and how far one is.

/** @typedef {{ mission: string, runs: string, vary: string, seed: string, limit: string, compare: string }} Form */

const WHOLE = /^\s*-?\d{1,9}\s*$/;

/**
 * What a form asks the server for, or what is wrong with it; the server checks all of it again.
 * @param {Form} form
 */
export function startOf({ mission, runs, vary, seed, limit, compare }) {
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

/** How many runs have ended. @param {Batch} batch */
export const doneOf = ({ outcomes, failed }) => Object.values(outcomes).reduce((sum, count) => sum + count, failed);
