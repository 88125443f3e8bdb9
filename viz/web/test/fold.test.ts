import assert from "node:assert/strict";
import { test } from "node:test";
import { containerOf, emptyState, foldOne, own } from "#core/fold.ts";
import { fixture, rounded } from "./fixtures.ts";

for (const { name, events, state } of fixture("folds.json"))
  test(`events add up to the same state as in Python: ${name}`, () => {
    const data = emptyState();
    for (const e of events) foldOne(data, e);
    assert.deepEqual(rounded(data), rounded(state));
  });

test("a fold goes on from a state that was sent as JSON", () => {
  for (const { events, state } of fixture("folds.json")) {
    const half = Math.floor(events.length / 2);
    let data = emptyState();
    for (const e of events.slice(0, half)) foldOne(data, e);
    data = JSON.parse(JSON.stringify(data));
    for (const e of events.slice(half)) foldOne(data, e);
    assert.deepEqual(rounded(data), rounded(state));
  }
});

test("maps hold what was put into them and nothing else", () => {
  assert.equal(own({}, "constructor"), undefined);
  assert.equal(own(null, "x"), undefined);
  assert.equal(own({ x: 1 }, "x"), 1);
});

test("the container of a path", () => {
  assert.equal(containerOf("/JOB/B/C"), "/JOB/B");
  assert.equal(containerOf("/JOB"), "/JOB");
});
