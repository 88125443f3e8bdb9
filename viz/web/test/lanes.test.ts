import assert from "node:assert/strict";
import { test } from "node:test";
import { Model } from "#core/model.ts";
import { Run } from "#core/run.ts";
import { Lanes } from "#drawing/lanes.ts";
import { event, fixture } from "./fixtures.ts";

const model = new Model(fixture("page_model.json"), false);
const run = new Run(null, [
  event("Started", "/PATROL"),
  event("Entered", "/PATROL/ROUND"),
  event("Entered", "/PATROL/ROUND/DRIVE"),
  event("Left", "/PATROL/ROUND/DRIVE", { outcome: "succeeded" }),
  event("Left", "/PATROL/ROUND", { outcome: "succeeded" }),
  event("Entered", "/PATROL/DOCK"),
]);
const at = (seconds: number) => (run.first() ?? 0) + 1000 * seconds;
const EVER = { from: -Infinity, to: Infinity };

function lanes() {
  const made = new Lanes();
  made.update(model, run.spans);
  return made;
}
const names = (some: { name: string }[]) => some.map((lane) => lane.name);

test("each container in which a state has run has a lane", () => {
  assert.deepEqual(names(lanes().all), ["PATROL", "ROUND"]);
  const made = lanes();
  const [, round] = made.all;
  assert.equal(made.rowsOf(round), round.kind === "concurrence" ? round.children.length : 1);
});

test("where there is no room, only lanes with a bar in the range are shown", () => {
  const made = lanes();
  assert.deepEqual(names(made.shown({ from: at(4.5), to: at(9) }, "", 1000)), ["PATROL", "ROUND"]);
  assert.deepEqual(names(made.shown({ from: at(4.5), to: at(9) }, "", made.totalOf(made.all) - 1)), ["PATROL"]);
});

test("lanes are found by their names and those of their states", () => {
  assert.deepEqual(names(lanes().shown(EVER, "drive", 1000)), ["ROUND"]);
  assert.deepEqual(names(lanes().shown(EVER, "dock, Drive", 1000)), ["PATROL", "ROUND"]);
  assert.deepEqual(lanes().shown(EVER, "nowhere", 1000), []);
});

test("new spans are added to their lanes, and another run begins anew", () => {
  const made = lanes();
  const [top] = made.all;
  const before = made.spansIn(top, -Infinity, Infinity).length;
  made.update(model, run.spans);
  assert.equal(made.spansIn(top, -Infinity, Infinity).length, before);
  made.update(model, []);
  assert.deepEqual(made.all, []);
});

test("actions of a plan that run at once have rows of their own, one after the other share one", () => {
  const payload = fixture("page_model.json");
  payload.explicit.kind = "plan";
  const plan = new Model(payload, false);
  const top = plan.root;
  const [round, dock] = top.children;
  const both = new Run(null, [
    event("Started", "/PATROL"),
    event("Entered", "/PATROL/ROUND"),
    event("Left", "/PATROL/ROUND", { outcome: "ok" }),
    event("Entered", "/PATROL/DOCK"),
  ]);
  const made = new Lanes();
  made.update(plan, both.spans);
  assert.equal(made.rowsOf(top), 1);
  const single = made.heightOf(top);
  both.push([event("Entered", "/PATROL/ROUND"), event("Left", "/PATROL/DOCK", { outcome: "ok" })]);
  made.update(plan, both.spans);
  assert.equal(made.rowsOf(top), 2);
  assert.ok(made.heightOf(top) > single);
  const last = both.last() ?? 0;
  assert.deepEqual([made.rowAt(top, dock, last), made.rowAt(top, round, last)], [0, 1]);
  assert.equal(made.rowAt(top, round, last - 3500), 0); // its first visit was alone
});
