import assert from "node:assert/strict";
import { test } from "node:test";
import { doneOf, startOf } from "#core/simulations.ts";
import type { Batch } from "#core/types.ts";

const FORM = { mission: "patrol", runs: "20", vary: "", seed: "1", limit: "4h", compare: "" };

test("a form becomes what the server is asked for", () => {
  const { asked, problem } = startOf({ ...FORM, vary: " battery=0.2..1.0 \n\nx=1,2\n", runs: " 7 " });
  assert.equal(problem, "");
  assert.deepEqual(asked, {
    ...{ command: "start", mission: "patrol", runs: 7, vary: ["battery=0.2..1.0", "x=1,2"], seed: 1 },
    ...{ limit: "4h", compare: "" },
  });
});

test("all that is wrong is told at once", () => {
  for (const runs of ["", "0", "-3", "1e3", "NaN", "many", "2.5"]) {
    const { asked, problem } = startOf({ ...FORM, runs, seed: "x", mission: "" });
    assert.equal(asked, null);
    for (const word of ["runs", "seed", "mission"]) assert.ok(problem.includes(word), problem);
  }
});

test("runs that failed have ended too", () => {
  const batch = { outcomes: { succeeded: 3, __proto__x: 1 }, failed: 2 } as unknown as Batch;
  assert.equal(doneOf(batch), 6);
});
