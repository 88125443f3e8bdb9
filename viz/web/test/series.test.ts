import assert from "node:assert/strict";
import { test } from "node:test";
import { emptyState, foldOne } from "#core/fold.ts";
import { Run } from "#core/run.ts";
import * as series from "#core/series.ts";
import { event } from "./fixtures.ts";

const feedback = (x: number) => ({
  $msg: "move_base_msgs/MoveBaseFeedback",
  fields: { base_position: { $msg: "geometry_msgs/PoseStamped", fields: { x, frame_id: "map", ok: true } } },
});

const DOCK = {
  $object: "Waypoint",
  fields: { name: "dock", pose: { $object: "Pose2D", fields: { x: 2, y: -3e-5, yaw: null } } },
};

test("numbers are found in messages, objects, lists and plain values", () => {
  const paths = (value: unknown) => series.numbersIn(value).map((path) => path.join("."));
  assert.deepEqual(paths(3), [""]);
  assert.deepEqual(paths(feedback(1)), ["base_position.x", "base_position.ok"]);
  assert.deepEqual(paths(DOCK), ["pose.x", "pose.y"]);
  assert.deepEqual(paths({ $tuple: [1, { $int: "98765432109876543210" }] }), ["0", "1"]);
  assert.deepEqual(
    paths({
      $items: [
        ["left", 3],
        [7, true],
      ],
    }),
    ["left", "7"],
  );
  assert.deepEqual(paths({ list: [1, "two", 3], deep: { constructor: 4 } }), ["list.0", "list.2", "deep.constructor"]);
  for (const odd of [null, "a sentence", "12 parcels", "nan", "1.2.3", [], {}, { $float: "nan" }, { $repr: "P(x=1)" }])
    assert.deepEqual(paths(odd), []);
  assert.ok(series.numbersIn(Array.from({ length: 9 }, () => Array.from({ length: 99 }, () => 1))).length <= 64);
  const loop: any = {};
  loop.me = loop;
  loop.one = 1;
  assert.ok(series.numbersIn(loop).length <= 60);
});

test("an id names a number wherever it comes from, and nothing else does", () => {
  const origins = [
    { source: "userdata", owner: "/JOB, 1/\u{1f916}", path: ["a key", "x,y"] },
    { source: "feedback", owner: "robot/move_base", path: ["base_position", "x"] },
    { source: "progress", owner: "move_base", path: ["fraction"] },
    { source: "topic", owner: "battery", path: [] },
  ];
  for (const origin of origins as series.Origin[]) assert.deepEqual(series.originOf(series.idOf(origin)), origin);
  for (const odd of [
    "",
    "topic",
    "topic,",
    "feedback,x",
    "progress,x,constructor",
    "%,x",
    "code,x",
    "topic,".padEnd(999, "x"),
  ])
    assert.equal(series.originOf(odd), null, odd);
  for (const odd of [null, "x", {}, [[]], [["%"]], [[1]], ["topic,x"]]) assert.deepEqual(series.knownPlots(odd), []);
  assert.equal(series.knownPlots(Array.from({ length: 50 }, () => ["topic,x"])).length, 6);
});

const run = () =>
  new Run(null, [
    event("Started", "/JOB"),
    event("UserdataWritten", "/JOB/A", { key: "count", value: 1 }),
    event("GoalSent", "/JOB/A", { action: "go", goal_id: "1", goal: null }),
    event("GoalFeedback", "/JOB/A", {
      action: "go",
      goal_id: "1",
      feedback: feedback(5),
      progress: { distance: 4, fraction: null },
    }),
    event("GoalFeedback", "/JOB/A", {
      action: "go",
      goal_id: "1",
      feedback: feedback(6),
      progress: { distance: 3, fraction: null },
    }),
    event("GoalDone", "/JOB/A", { action: "go", goal_id: "1", status: "SUCCEEDED", text: "", result: null }),
    event("GoalSent", "/JOB/A", { action: "go", goal_id: "2", goal: null }),
    event("GoalFeedback", "/JOB/A", { action: "go", goal_id: "2", feedback: feedback(7) }),
    event("UserdataWritten", "/JOB/A", { key: "count", value: "lost" }),
  ]);

test("samples are read from a run as it goes on, with a break between goals", () => {
  const one = run();
  const x = new series.Samples("feedback,go,base_position,x");
  assert.deepEqual(
    x.update(one, new Map()).map(({ value }) => value),
    [5, 6, null, null, 7],
  );
  one.push([event("GoalFeedback", "/JOB/A", { action: "go", goal_id: "2", feedback: feedback(8) })]);
  assert.deepEqual(
    x
      .update(one, new Map())
      .map(({ value }) => value)
      .slice(-2),
    [7, 8],
  );
  assert.equal(x.update(one, new Map()).length, 6); // nothing is read twice
  const other = run();
  assert.equal(x.update(other, new Map()).length, 5); // another run begins anew
  const count = new series.Samples("userdata,%2FJOB,count");
  assert.deepEqual(
    count.update(one, new Map()).map(({ value }) => value),
    [1, null],
  ); // no number any more
  assert.equal(series.valueAt(count.list, count.list[0].t - 1), null);
  assert.equal(series.valueAt(count.list, count.list[0].t + 1), 1);
});

test("events that are forgotten are not read again", () => {
  const one = new Run(null, []);
  const count = new series.Samples("userdata,%2FJOB,count");
  for (let i = 0; i < 5; i++) {
    one.push(
      Array.from({ length: 400 }, (_, k) => event("UserdataWritten", "/JOB/A", { key: "count", value: 400 * i + k })),
    );
    one.trim(600);
    count.update(one, new Map());
  }
  assert.deepEqual(
    count.list.map(({ value }) => value),
    Array.from({ length: 2000 }, (_, i) => i),
  );
});

test("what can be plotted, and what is at first", () => {
  const data = emptyState();
  for (const e of run().events) foldOne(data, e);
  data.goals[2].progress = { distance: 3, fraction: null, text: "" };
  const origins = series.originsIn(data, ["robot_0/battery"]);
  assert.deepEqual(origins.map(series.labelOf), [
    "robot_0/battery",
    "distance left",
    "base_position.x",
    "base_position.ok",
  ]);
  assert.deepEqual(series.usualPlots(data, ["speed", "robot_0/battery"]), [
    ["topic,robot_0%2Fbattery"],
    ["progress,go,distance"],
  ]);
});

test("series of one plot share their instants", () => {
  const one = new series.Samples("userdata,%2FJOB,a");
  one.list = [
    { t: 1, value: 1 },
    { t: 3, value: 3 },
    { t: 9, value: 4 },
  ];
  const two = new series.Samples("topic,b");
  two.list = [
    { t: 2, value: 5 },
    { t: 3, value: null },
  ];
  assert.deepEqual(series.aligned([one, two], 2, 4, 20), [
    [1, 2, 3, 9, 20],
    [1, undefined, 3, 4, 4],
    [undefined, 5, null, undefined, undefined],
  ]);
  assert.deepEqual(series.aligned([], 0, 1, 0), [[]]);
});

test("numbers for people", () => {
  assert.deepEqual([0, 3, 1.23456789, -0.00012, 2e9, 75.125].map(series.numberText), [
    "0",
    "3",
    "1.235",
    "-1.20e-4",
    "2.00e+9",
    "75.13",
  ]);
});
