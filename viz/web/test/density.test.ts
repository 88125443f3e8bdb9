import assert from "node:assert/strict";
import { test } from "node:test";
import { asksIn, densityOf } from "#core/density.ts";
import type { RunEvent, Wait } from "#core/types.ts";

const at = (t: number, kind: string, facts: object = {}) =>
  ({ kind, path: "/M/A", t: 0, seq: 0, stamp_ns: t * 1e6, ...facts }) as RunEvent;

test("every failure and preempt has its instant, however many events there are", () => {
  const events = Array.from({ length: 5000 }, (_, i) => at(i, "Iterated", { number: i }));
  events.splice(1234, 0, at(1234, "Left", { outcome: "aborted" }));
  events.splice(4000, 0, at(4000, "PreemptRequested"), at(4000, "Failed", { error: "no" }));
  const { counts, failures, preempts } = densityOf(events, (t) => t / 50, 100);
  assert.deepEqual(failures, [1234, 4000]);
  assert.deepEqual(preempts, [4000]);
  assert.equal(counts.length, 100);
  assert.equal(
    counts.reduce((a, b) => a + b),
    5003,
  );
});

test("a run that begins again is parted from the one before", () => {
  assert.deepEqual(densityOf([at(1, "Started"), at(9, "Finished"), at(20, "Started")], (t) => t / 10, 3).starts, [20]);
});

test("an open question lasts until now", () => {
  const wait = (kind: Wait["kind"], from: number, to: number | null) => ({ path: "/M/A", kind, from, to, text: "" });
  assert.deepEqual(asksIn([wait("asks", 1, null), wait("paused", 2, 3), wait("asks", 4, 5)], 9), [
    [1, 9],
    [4, 5],
  ]);
});
