import assert from "node:assert/strict";
import { test } from "node:test";
import { Model } from "#core/model.ts";
import { Run } from "#core/run.ts";
import { coverage, heatScale, MODES, numbersFor } from "#core/statistics.ts";
import type { StateStatistics } from "#core/types.ts";
import { fixture } from "./fixtures.ts";

const { events, statistics, never_taken } = fixture("statistics.json");
const run = new Run(null, events).now.states;
const model = new Model(fixture("page_model.json"), false);

test("a run counts as Python counts recorded runs", () => {
  assert.deepEqual(Object.keys(run).sort(), Object.keys(statistics.states).sort());
  for (const [path, recorded] of Object.entries<StateStatistics>(statistics.states)) {
    const state = run[path];
    assert.equal(state.visits, recorded.visits);
    assert.deepEqual(state.outcomes, recorded.outcomes);
    assert.equal(state.seconds, recorded.total);
  }
});

test("transitions that were never taken", () => {
  const { taken, all } = coverage(model, run);
  assert.equal(all - taken, never_taken.length);
  assert.deepEqual(coverage(null, {}), { taken: 0, all: 0 });
});

test("numbers of recorded runs are those of this run when they are the same", () => {
  const own = numbersFor("counts", run, statistics, model);
  const recorded = numbersFor("runs", {}, statistics, model);
  for (const path of Object.keys(run))
    for (const outcome of ["succeeded", "aborted", "low", "constructor"])
      assert.deepEqual(own.countOf?.(path, outcome), recorded.countOf?.(path, outcome));
  assert.deepEqual(own.countOf?.("/PATROL/DOCK", "aborted"), { count: 2, share: 0.5 });
  assert.equal(own.countOf?.("/PATROL/DOCK", "constructor"), null);
});

test("heat is between 0 and 1, whatever is known", () => {
  for (const [mode] of MODES)
    for (const known of [statistics, null]) {
      const { heatOf } = numbersFor(mode, run, known, model);
      for (const path of [...Object.keys(run), "/NOWHERE"]) {
        const heat = heatOf?.(path) ?? 0;
        assert.ok(heat >= 0 && heat <= 1, `${mode} ${path} ${heat}`);
      }
    }
  assert.equal(numbersFor("time", run, null, model).heatOf?.("/PATROL/DOCK"), 1); // the longest of all leaves
  assert.equal(numbersFor("failures", run, statistics, model).heatOf?.("/PATROL/DOCK"), 0.75);
});

test("a state that runs is compared by its finished visits alone", () => {
  const recorded = { ...statistics, states: { "/A": { ...statistics.states["/PATROL/DOCK"], median: 1 } } };
  const state = { visits: 2, since: 1, outcome: "ok", outcomes: { ok: 1 }, seconds: 2 };
  assert.equal(numbersFor("compare", { "/A": state }, recorded, model).heatOf?.("/A"), 1);
  const first = { visits: 1, since: 1, outcome: null, outcomes: {}, seconds: 0 };
  assert.equal(numbersFor("compare", { "/A": first }, recorded, model).heatOf?.("/A"), 0);
});

test("heat has a scale in every mode that has heat", () => {
  for (const [mode] of MODES) {
    const { heatOf } = numbersFor(mode, run, statistics, model);
    const scale = heatScale(mode, run, model);
    assert.equal(scale !== null, heatOf !== null, mode);
  }
  assert.equal(heatScale("time", run, model)?.[0], "0 s");
});
