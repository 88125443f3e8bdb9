import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import * as store from "#core/store.ts";
import type { MachineFacts, RunEvent } from "#core/types.ts";
import { event, fixture } from "./fixtures.ts";

const FACTS: MachineFacts = {
  name: "one",
  label: "PATROL",
  epoch: "1",
  revision: 1,
  stale: null,
  control: null,
  recorded: false,
  node: "",
  behind: null,
  before: null,
  after: null,
  refused: 0,
  refusal: "",
};

let events: RunEvent[] = [];

beforeEach(() => {
  events = [
    event("Started", "/JOB"),
    event("Entered", "/JOB/A"),
    event("GoalSent", "/JOB/A", { action: "/drive", goal_id: "1", goal: null }),
    event("Left", "/JOB/A", { outcome: "ok" }),
    event("Entered", "/JOB/B"),
  ];
  events[4].stamp_ns = events[3].stamp_ns; // a transition is two events of one instant
  store.connection.value = "live";
  store.facts.value = FACTS;
  store.startRun(null, events);
});

test("go back and forward event by event, though some share an instant", () => {
  const seen = [];
  for (let i = 0; i < 5; i++) {
    store.seekEvent(-1);
    seen.push(store.eventsShown());
  }
  assert.deepEqual(seen, [4, 3, 2, 1, 1]);
  assert.deepEqual(store.activePaths.value, ["/JOB"]);
  for (let i = 0; i < 4; i++) store.seekEvent(1);
  assert.equal(store.cursor.value, null);
  assert.deepEqual(store.activeLeaves.value, ["/JOB/B"]);
});

test("an instant outside the run is its first or last one", () => {
  store.seek(-Infinity);
  assert.equal(store.eventsShown(), 1);
  assert.equal(store.runStatus.value.word, "replay");
  store.seek(Infinity);
  assert.equal(store.eventsShown(), events.length);
  assert.deepEqual(store.shown(), store.run.now);
});

test("what is looked at stays when the oldest events are forgotten", () => {
  const more = Array.from({ length: 1000 }, () => event("Iterated", "/JOB", { number: 0 }));
  store.addEvents(more);
  store.seekTo(900);
  const shown = store.shown();
  store.settings.value = { ...store.settings.value, kept: 500 };
  store.addEvents([event("Iterated", "/JOB", { number: 7 })]);
  assert.equal(store.eventsShown(), 500);
  assert.deepEqual(store.shown(), shown);
  assert.deepEqual(store.run.after(store.eventsShown()), shown);
});

test("a goal has no server when none was seen that would answer", () => {
  const goal = store.run.now.goals["1"];
  const seen = { goals: [], known: true };
  const server = { name: "drive", type: "t", node: "n", servers: 1 };
  assert.equal(store.hasNoServer(goal), false); // nobody has looked
  store.actions.value = { actions: [], gone: [], ...seen };
  assert.equal(store.hasNoServer(goal), true);
  store.actions.value = { actions: [server], gone: [], ...seen };
  assert.equal(store.hasNoServer(goal), false);
  store.addEvents([event("GoalSent", "/JOB/B", { action: "drive", goal_id: "2", goal: null })]);
  store.addEvents([event("GoalDone", "/JOB/B", { goal_id: "2", status: "SUCCEEDED", text: "", result: {} })]);
  store.actions.value = { actions: [], gone: [], ...seen };
  assert.equal(store.hasNoServer(goal), false); // it answers behind a bridge
  store.actions.value = { actions: [], gone: ["drive"], ...seen };
  assert.equal(store.hasNoServer(goal), true);
  store.connection.value = "lost";
  assert.equal(store.hasNoServer(goal), false);
  assert.equal(store.hasNoServer(null), false);
});

test("how the run stands, in one word", () => {
  assert.equal(store.runStatus.value.word, "running");
  store.facts.value = { ...FACTS, control: { paused: true, breakpoints: [] } };
  assert.equal(store.runStatus.value.word, "paused");
  store.facts.value = { ...FACTS, stale: 1 };
  assert.equal(store.runStatus.value.word, "stale");
  store.addEvents([event("Finished", "/JOB", { outcome: "done" })]);
  store.tick.value += 1;
  assert.equal(store.runStatus.value.word, "ended: done");
  store.facts.value = null;
  assert.equal(store.runStatus.value.word, "waiting");
});

test("containers around a state are opened for it, and what the user opens stays", () => {
  store.setModel(fixture("page_model.json"));
  store.setOpened(new Set(["/PATROL"]));
  assert.equal(store.reveal("/PATROL/ROUND/DRIVE"), true);
  assert.deepEqual([...store.opened.value], ["/PATROL", "/PATROL/ROUND"]);
  assert.equal(store.reveal("/PATROL/ROUND/DRIVE"), false);
  store.follow.value = true;
  store.toggle("/PATROL/ROUND");
  assert.deepEqual([...store.opened.value], ["/PATROL"]);
  assert.equal(store.follow.value, false);
  assert.equal(store.openOneLevelLess(), false);
});

test("implicit transitions of the same machine", () => {
  store.setModel(fixture("page_model.json"));
  const links = () => store.model.value?.root.links.length ?? 0;
  const before = links();
  store.setImplicit(true);
  assert.ok(links() > before);
  store.setImplicit(false);
  assert.equal(links(), before);
});

test("where a run ended is in the state that was left last, not in one whose name begins so", () => {
  const began = [event("Entered", "/JOB/A"), event("Entered", "/JOB/AB/X")];
  const ends = [event("Left", "/JOB/A", { outcome: "ok" }), event("Left", "/JOB/AB/X", { outcome: "ok" })];
  ends[1].stamp_ns = ends[0].stamp_ns;
  store.startRun(null, [...began, ...ends]);
  store.tick.value += 1;
  assert.deepEqual(store.lastLeaves.value, ["/JOB/A"]);
});
