import assert from "node:assert/strict";
import { test } from "node:test";
import { goalText, purposeOf, purposeOfVisit, wordsOf } from "#core/purposes.ts";
import { store } from "#core/store.ts";
import { event } from "./fixtures.ts";

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
