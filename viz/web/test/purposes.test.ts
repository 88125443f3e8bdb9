import assert from "node:assert/strict";
import { test } from "node:test";
import { Model } from "#core/model.ts";
import { goalText, purposeOf, purposeOfState, purposeOfVisit, wordsOf } from "#core/purposes.ts";
import { store } from "#core/store.ts";
import { event, fixture } from "./fixtures.ts";

const pose = (x: number, y: number) => ({
  $msg: "move_base_msgs/MoveBaseGoal",
  fields: { target_pose: { $msg: "p", fields: { position: { x, y }, orientation: { w: 1 } } } },
});
const KITCHEN = { $object: "Waypoint", fields: { name: "kitchen", x: 3, y: 2 } };

test("a goal is for the place that it leads to, or for what its fields name", () => {
  store.startRun(null, [
    event("Started", "/M"),
    event("UserdataWritten", "/M/NEXT", { key: "place", value: KITCHEN }),
    event("Entered", "/M/DRIVE"),
    event("GoalSent", "/M/DRIVE", { action: "r1/move_base", goal_id: "1", goal: pose(3, 2) }),
    event("Left", "/M/DRIVE", { outcome: "ok" }),
    event("Entered", "/M/DRIVE"),
    event("GoalSent", "/M/DRIVE", { action: "r1/move_base", goal_id: "2", goal: pose(7, 1) }),
    event("Retried", "/M/DRIVE", { attempt: 2, reason: "aborted" }),
  ]);
  const [, first, second] = store.data.run.spans;
  assert.equal(purposeOfVisit(first), "kitchen");
  assert.equal(purposeOfVisit(second), "(7.0, 1.0)");
  assert.equal(purposeOf("9", { goal: { $msg: "G", fields: { station: "dock" } } }), "dock");
  assert.equal(purposeOf("9", { goal: null }), "");
  const goal = { action: "/r1/move_base", goal: pose(3, 2), progress: { distance: 3.14 } } as any;
  assert.equal(goalText("1", goal), "r1/move_base \u2192 kitchen, 3.1 m left");
  assert.deepEqual(wordsOf("DRIVE", first, 1e12), [
    "DRIVE \u2192 kitchen 2.0 s",
    "DRIVE \u2192 kitchen",
    "\u2192 kitchen 2.0 s",
    "\u2192 kitchen",
    "kitchen",
  ]);
  assert.equal(wordsOf("DRIVE", second, second.from + 4000)[0], "DRIVE \u2192 (7.0, 1.0), attempt 3 4.0 s");
});

test("without a purpose a bar has the state's name, and says that it cleans up", () => {
  store.startRun(null, [
    event("Started", "/M"),
    event("Entered", "/M/WAIT"),
    event("PreemptRequested", "/M/WAIT"),
    event("PreemptServiced", "/M/WAIT"),
  ]);
  const span = store.data.run.spans[1];
  assert.deepEqual(wordsOf("WAIT", span, span.from + 500), ["WAIT 0.5 s", "WAIT"]);
  assert.equal(wordsOf("WAIT", span, span.from + 5000)[0], "WAIT, cleaning up 5.0 s");
});

test("bars of a clean-up say so, while it runs and afterwards", () => {
  store.startRun(null, [
    event("Started", "/PATROL"),
    event("Entered", "/PATROL/DOCK"),
    event("Left", "/PATROL/DOCK", { outcome: "ok" }),
    event("Entered", "/PATROL/ROUND"),
    event("Entered", "/PATROL/ROUND/DRIVE"),
  ]);
  const payload = fixture("page_model.json");
  payload.explicit.children[0].details = [["runs", "at any end"]]; // of ROUND
  store.data.model.value = new Model(payload, false);
  const [, dock, tidying, inside] = store.data.run.spans;
  assert.equal(wordsOf("DOCK", dock, dock.from + 500)[0], "DOCK 0.5 s");
  assert.equal(wordsOf("ROUND", tidying, tidying.from + 2000)[0], "ROUND, tidying up 2.0 s");
  assert.equal(wordsOf("ROUND", { ...tidying, to: tidying.from + 3000 }, 1e12)[0], "ROUND, tidied up 3.0 s");
  assert.equal(wordsOf("DRIVE", inside, inside.from + 2000)[0], "DRIVE, tidying up 2.0 s");
  assert.equal(purposeOfState("/PATROL/ROUND/DRIVE"), "tidying up");
  store.data.model.value = null;
});

test("times of waiting have a beginning, an end and a reason", () => {
  store.startRun(null, [
    event("Started", "/M"),
    event("Entered", "/M/A"),
    event("QuestionAsked", "/M/A", { text: "?" }),
    event("QuestionAnswered", "/M/A", { answer: "yes" }),
    event("Left", "/M/A", { outcome: "ok" }),
    event("Paused", "/M/B", { reason: "breakpoint" }),
    event("Resumed", "/M/B"),
    event("Entered", "/M/B"),
    event("Left", "/M/B", { outcome: "ok" }),
    event("Paused", "/M/C", { reason: "pause" }),
  ]);
  const [asks, held, paused] = store.data.run.waits;
  assert.deepEqual([asks.kind, asks.path, (asks.to ?? 0) - asks.from], ["asks", "/M/A", 1000]);
  assert.deepEqual([held.kind, held.text, (held.to ?? 0) - held.from], ["paused", "paused (breakpoint)", 1000]);
  assert.deepEqual([paused.path, paused.text, paused.to], ["/M/C", "paused", null]);
});
