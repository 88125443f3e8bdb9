import assert from "node:assert/strict";
import { test } from "node:test";
import { countText, lanesOf, nameOfRow, sceneOf } from "#core/fleet.ts";
import type { FleetRow } from "#core/types.ts";
import { fixture } from "./fixtures.ts";

/** @param began [s] */
const row = (name: string, began: number, facts: object = {}): FleetRow =>
  ({
    ...{ id: `machine ${name}`, name, machine: "PATROL", robots: [], live: true, began: began * 1e9, last: null },
    strip: [
      [0, "GO", 0, 2, "success"],
      [0, "DOCK", 2, null, "active"],
    ],
    observed: [],
    events: [],
    ...facts,
  }) as unknown as FleetRow;

test("the fleet says how many runs there are, and which of them are shown", () => {
  const rows = Array.from({ length: 32 }, (_, i) => row(String(i), 100));
  assert.equal(countText({ rows, skip: 0, total: 1000 }), "1 to 32 of 1,000 live runs");
  assert.equal(countText({ rows: [], skip: 0, total: 0 }), "0 live runs");
  assert.equal(countText({ rows: [row("a", 100)], skip: 0, total: 1 }), "1 live run");
});

test("lanes share an axis, and what runs ends now", () => {
  const { seconds, lanes } = lanesOf([row("a", 100), row("b", 103)], 110_000);
  assert.equal(seconds, 10);
  assert.deepEqual(
    lanes.map((lane) => lane.bars.map(({ from, to }) => [from, to])),
    [
      [
        [0, 2],
        [2, 10],
      ],
      [
        [3, 5],
        [5, 10],
      ],
    ],
  );
  assert.deepEqual(lanesOf([], 0), { seconds: 1, lanes: [] });
});

test("lanes of runs without a robot fill their axis, too: nothing but the runs tells their time", () => {
  const { seconds, lanes } = lanesOf([row("a", 1.8e9, { last: 1.8e18 + 8e9 })], 0);
  assert.equal(seconds, 8);
  assert.deepEqual(
    lanes[0].bars.map(({ from, to }) => [from, to]),
    [
      [0, 2],
      [2, 8],
    ],
  );
});

test("robots of several runs are apart on one map", () => {
  const observed = fixture("observed.json").slice(0, 2);
  const goal = { kind: "GoalSent", path: "/P/GO", stamp_ns: 5e9, seq: 1, action: "move_base", goal_id: "1", goal: {} };
  const { scene, now } = sceneOf([
    row("a", 0, { observed, events: [goal] }),
    row("b", 0, { observed: [{ ...observed[1], robot: "robot_2" }] }),
  ]);
  assert.equal(now, 5000);
  assert.equal(scene.maps.length, 1);
  const driven = [...scene.robots].filter(([, robot]) => robot.poses.length).map(([name]) => name);
  assert.deepEqual(driven.sort(), ["a", "robot_2"]);
});

test("a run is called as its one robot, else as its machine", () => {
  assert.equal(nameOfRow(row("patrol", 0, { robots: ["robot_1"] })), "robot_1");
  assert.equal(nameOfRow(row("patrol (2)", 0)), "patrol (2)");
});
