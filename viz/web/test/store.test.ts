import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { createStore, store } from "#core/store.ts";
import type { RunEvent } from "#core/types.ts";
import { event, FACTS, fixture } from "./fixtures.ts";

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
  store.data.connection.value = "live";
  store.data.facts.value = FACTS;
  store.startRun(null, events);
});

test("go back and forward event by event, though some share an instant", () => {
  const seen = [];
  for (let i = 0; i < 5; i++) {
    store.playback.seekEvent(-1);
    seen.push(store.playback.eventsShown());
  }
  assert.deepEqual(seen, [4, 3, 2, 1, 1]);
  assert.deepEqual(store.status.activePaths.value, ["/JOB"]);
  for (let i = 0; i < 4; i++) store.playback.seekEvent(1);
  assert.equal(store.playback.cursor.value, null);
  assert.deepEqual(store.status.activeLeaves.value, ["/JOB/B"]);
});

test("an instant outside the run is its first or last one", () => {
  store.playback.seek(-Infinity);
  assert.equal(store.playback.eventsShown(), 1);
  assert.equal(store.status.runStatus.value.word, "replay");
  store.playback.seek(Infinity);
  assert.equal(store.playback.eventsShown(), events.length);
  assert.deepEqual(store.playback.shown(), store.data.run.now);
});

test("what is looked at stays when the oldest events are forgotten", () => {
  const more = Array.from({ length: 1000 }, () => event("Iterated", "/JOB", { number: 0 }));
  store.addEvents(more);
  store.playback.seekTo(900);
  const shown = store.playback.shown();
  store.data.settings.value = { ...store.data.settings.value, kept: 500 };
  store.addEvents([event("Iterated", "/JOB", { number: 7 })]);
  assert.equal(store.playback.eventsShown(), 500);
  assert.deepEqual(store.playback.shown(), shown);
  assert.deepEqual(store.data.run.after(store.playback.eventsShown()), shown);
});

test("a goal has no server when none was seen that would answer", () => {
  const goal = store.data.run.now.goals["1"];
  const seen = { goals: [], known: true };
  const server = { name: "drive", type: "t", node: "n", servers: 1 };
  assert.equal(store.status.hasNoServer(goal), false); // nobody has looked
  store.data.actions.value = { actions: [], gone: [], ...seen };
  assert.equal(store.status.hasNoServer(goal), true);
  store.data.actions.value = { actions: [server], gone: [], ...seen };
  assert.equal(store.status.hasNoServer(goal), false);
  store.addEvents([event("GoalSent", "/JOB/B", { action: "drive", goal_id: "2", goal: null })]);
  store.addEvents([event("GoalDone", "/JOB/B", { goal_id: "2", status: "SUCCEEDED", text: "", result: {} })]);
  store.data.actions.value = { actions: [], gone: [], ...seen };
  assert.equal(store.status.hasNoServer(goal), false); // it answers behind a bridge
  store.data.actions.value = { actions: [], gone: ["drive"], ...seen };
  assert.equal(store.status.hasNoServer(goal), true);
  store.data.connection.value = "lost";
  assert.equal(store.status.hasNoServer(goal), false);
  assert.equal(store.status.hasNoServer(null), false);
});

test("how the run stands, in one word", () => {
  assert.equal(store.status.runStatus.value.word, "running");
  store.data.facts.value = { ...FACTS, control: { paused: true, breakpoints: [] } };
  assert.equal(store.status.runStatus.value.word, "paused");
  store.data.facts.value = { ...FACTS, stale: 1 };
  assert.equal(store.status.runStatus.value.word, "stale");
  store.addEvents([event("Finished", "/JOB", { outcome: "done" })]);
  store.playback.update();
  assert.equal(store.status.runStatus.value.word, "ended: done");
  store.data.facts.value = null;
  assert.equal(store.status.runStatus.value.word, "waiting");
});

test("containers around a state are opened for it, and what the user opens stays", () => {
  store.view.setModel(fixture("page_model.json"));
  store.view.setOpened(new Set(["/PATROL"]));
  assert.equal(store.view.reveal("/PATROL/ROUND/DRIVE"), true);
  assert.deepEqual([...store.view.opened.value], ["/PATROL", "/PATROL/ROUND"]);
  assert.equal(store.view.reveal("/PATROL/ROUND/DRIVE"), false);
  store.view.follow.value = true;
  store.view.toggle("/PATROL/ROUND");
  assert.deepEqual([...store.view.opened.value], ["/PATROL"]);
  assert.equal(store.view.follow.value, false);
  assert.equal(store.view.openOneLevelLess(), false);
});

test("implicit transitions of the same machine", () => {
  store.view.setModel(fixture("page_model.json"));
  const links = () => store.data.model.value?.root.links.length ?? 0;
  const before = links();
  store.view.setImplicit(true);
  assert.ok(links() > before);
  store.view.setImplicit(false);
  assert.equal(links(), before);
});

test("where a run ended is in the state that was left last, not in one whose name begins so", () => {
  const began = [event("Entered", "/JOB/A"), event("Entered", "/JOB/AB/X")];
  const ends = [event("Left", "/JOB/A", { outcome: "ok" }), event("Left", "/JOB/AB/X", { outcome: "ok" })];
  ends[1].stamp_ns = ends[0].stamp_ns;
  store.startRun(null, [...began, ...ends]);
  store.playback.update();
  assert.deepEqual(store.status.lastLeaves.value, ["/JOB/A"]);
});

test("a store knows nothing of another one", () => {
  const other = createStore();
  other.startRun(null, [event("Started", "/OTHER")]);
  other.view.selected.value = "/OTHER";
  assert.deepEqual(other.status.activePaths.value, ["/OTHER"]);
  assert.equal(store.view.selected.value, null);
  assert.ok(!store.data.run.events.some((one) => one.path === "/OTHER"));
});

test("shared notes and those of this browser stand in one list; a link has only the latter", () => {
  store.notes.shared.value = [
    { at: 3, text: "c", by: "Ada" },
    { at: 1, text: "a", by: "" },
  ];
  store.notes.own.value = [];
  store.notes.add([
    { at: 2, text: "b" },
    { at: 1, text: "a" },
  ]);
  const shown = store.notes.all.value.map(({ text, by }) => [text, by]);
  assert.deepEqual(shown, [
    ["a", ""],
    ["b", undefined],
    ["c", "Ada"],
  ]);
  store.notes.remove(store.notes.all.value[1]);
  assert.deepEqual(
    store.notes.own.value.map(({ text }) => text),
    ["a"],
  );
  store.notes.shared.value = Array.from({ length: 100 }, (_, at) => ({ at, text: `${at}`, by: "" }));
  assert.equal(store.notes.all.value.length, 101);
});
