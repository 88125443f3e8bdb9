import assert from "node:assert/strict";
import { test } from "node:test";
import { Model } from "#core/model.ts";
import { Run } from "#core/run.ts";
import { around, beginOf, twoRuns } from "#core/two_runs.ts";
import type { RunDifference } from "#core/wire.ts";
import { event } from "./fixtures.ts";

const node = (name: string, path: string, kind: string, children: any[] = []): any => ({
  ...{ label: name, caption: "", path, kind, children, outcomes: [], details: [], success: null },
  ...{ edges: [], rules: [], forks: [], initial: [], cleanup: "" },
});
const machine = () => {
  const both = node("BOTH", "/JOB/BOTH", "concurrence", [
    node("DRIVE", "/JOB/BOTH/DRIVE", "action"),
    node("WATCH", "/JOB/BOTH/WATCH", "monitor"),
  ]);
  const root = node("JOB", "/JOB", "machine", [both, node("HOME", "/JOB/HOME", "state")]);
  return new Model({ explicit: root, implicit: root, keys: [] } as any, false);
};
/** Events of a run that watches for some seconds. @param begin [s] */
function run(begin: number, watched: number, outcome: string) {
  const at = (s: number, kind: string, path: string, facts: object = {}) =>
    event(kind, path, { ...facts, stamp_ns: (begin + s) * 1e9 });
  return new Run(null, [
    at(0, "Started", "/JOB"),
    at(1, "Entered", "/JOB/BOTH"),
    at(1, "Entered", "/JOB/BOTH/WATCH"),
    at(1, "Entered", "/JOB/BOTH/DRIVE"),
    at(1 + watched, "Left", "/JOB/BOTH/WATCH", { outcome }),
    at(1 + watched, "Left", "/JOB/BOTH", { outcome }),
    at(1 + watched, "Entered", "/JOB/HOME"),
  ]);
}
const difference: RunDifference = {
  ...{ number: 5, at: 5, path: "/JOB/BOTH/WATCH", recorded: "WATCH  invalid", now: "WATCH  goes on" },
  ...{ before: [], recorded_next: [], now_next: [], later: 0.5 },
};

test("two runs share their lanes, branches have one each, and 0 is the first difference", () => {
  const [recorded, now] = [run(100, 4, "invalid"), run(7000, 9, "preempted")];
  const found = twoRuns({ recorded, now, model: machine() }, difference, true);
  assert.deepEqual(
    found.names.map(([, name]) => name),
    ["JOB", "DRIVE", "WATCH"],
  );
  const watch = (lanes: typeof found.now) => lanes[2].bars.map(({ from, to, differs }) => [from, to, differs]);
  assert.deepEqual(watch(found.recorded), [[-4, 0, true]]);
  assert.deepEqual(watch(found.now), [[-4.5, 4.5, true]]);
  assert.deepEqual([found.from, found.to], [-4.5, 4.5]);
  assert.deepEqual(around({ from: -100, to: 300 }, 0), { from: -30, to: 60 });
});

test("from the begin, both runs begin at 0", () => {
  const [recorded, now] = [run(100, 4, "invalid"), run(7000, 4, "invalid")];
  const found = twoRuns({ recorded, now, model: machine() }, null, false);
  assert.deepEqual(
    [found.recorded, found.now].map((lanes) => lanes[0].bars.map(({ from, to }) => [from, to])),
    [
      [
        [1, 5],
        [5, 5],
      ],
      [
        [1, 5],
        [5, 5],
      ],
    ],
  );
  assert.ok([...found.recorded, ...found.now].every((lane) => lane.bars.every((bar) => !bar.differs)));
  assert.equal(found.recorded[0].bars[0].at, 101_000);
  assert.equal(beginOf(now), 7_000_000);
});

test("states that only one of the machines has have a lane, too", () => {
  const recorded = run(0, 4, "invalid");
  const now = new Run(null, [event("Started", "/JOB"), event("Entered", "/JOB/NEW/INNER")]);
  const { names } = twoRuns({ recorded, now, model: machine() }, null, false);
  assert.deepEqual(names.at(-1), ["/JOB/NEW", "NEW"]);
});
