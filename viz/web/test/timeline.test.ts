import "./browser.ts";
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { store } from "#core/store.ts";
import { beginningOf } from "#drawing/bars.ts";
import { MapView } from "#drawing/map.ts";
import { Timeline } from "#drawing/timeline.ts";
import { canvasOf, Paper } from "./browser.ts";
import { event, FACTS, fixture } from "./fixtures.ts";

const A = "/PATROL/ROUND/DRIVE";

beforeEach(() => {
  store.data.facts.value = { ...FACTS, recorded: true };
  store.view.setModel(fixture("page_model.json"));
  store.startRun(null, [
    event("Started", "/PATROL"),
    event("Entered", "/PATROL/ROUND"),
    event("Entered", A),
    event("Left", A, { outcome: "aborted" }),
    event("Left", "/PATROL/ROUND", { outcome: "aborted" }),
    event("Entered", "/PATROL/DOCK"),
    event("QuestionAsked", "/PATROL/DOCK", { text: "Dock?" }),
    event("QuestionAnswered", "/PATROL/DOCK", { answer: "yes", by: "ann" }),
    event("Noted", "/PATROL/DOCK", { text: "bay 2" }),
    event("Left", "/PATROL/DOCK", { outcome: "succeeded" }),
  ]);
});

/** A timeline of the whole run, after it was drawn. */
function drawn() {
  const paper = new Paper();
  const timeline = new Timeline(canvasOf(paper, 1000, 200), { onPick: () => {}, onDraw: () => {} });
  timeline.window.fitAll();
  timeline.draw();
  return { timeline, paper };
}

test("the timeline names its lanes, and each bar what it is for and how long it took", () => {
  const { texts } = drawn().paper;
  for (const text of ["PATROL", "ROUND", "DRIVE 1.0 s", "DOCK \u2192 bay 2 4.0 s", "DOCK ? 1.0 s"])
    assert.ok(texts.includes(text), `${text} in ${texts.join(", ")}`);
});

test("bars have the colours of their outcomes and the width of their time", () => {
  const { timeline, paper } = drawn();
  const [failed, docked] = [A, "/PATROL/DOCK"].map((path) => timeline.bars.hits.find((hit) => hit.span.path === path));
  assert.ok(failed && docked);
  assert.ok(Math.abs((docked.right - docked.left) / (failed.right - failed.left) - 4) < 0.01);
  const colourOf = (x: number) => paper.bars.find((bar) => bar.x === x && bar.h > 10)?.colour;
  assert.equal(colourOf(failed.left), "failure-fill");
  assert.equal(colourOf(docked.left), "success-fill");
});

test("the axis tells instants since the begin, and the instant shown has a flag", () => {
  assert.ok(drawn().paper.texts.includes("00:02"));
  store.playback.seek((store.data.run.first() ?? 0) + 2500);
  assert.ok(drawn().paper.texts.includes("00:02.5"));
});

test("a bar is pale after the instant shown", () => {
  store.playback.seek((store.data.run.first() ?? 0) + 5500);
  const { timeline, paper } = drawn();
  const docked = timeline.bars.hits.find((hit) => hit.span.path === "/PATROL/DOCK");
  const painted = paper.bars.filter(({ x, colour }) => x === docked?.left && colour === "active-fill");
  assert.deepEqual(
    painted.map(({ opacity }) => opacity),
    [0.35, 1],
  );
});

test("the flag of the instant shown covers no instant of the axis", () => {
  assert.ok(drawn().paper.texts.includes("00:03"));
  store.playback.seek((store.data.run.first() ?? 0) + 3100);
  const { texts } = drawn().paper;
  assert.ok(texts.includes("00:03.1") && !texts.includes("00:03"), texts.join(", "));
});

test("the name of a lane that has no room is cut with a sign", () => {
  const lane = store.data.model.value?.get("/PATROL/ROUND");
  assert.ok(lane);
  lane.name = "ROUND_OF_THE_HOUSE";
  const paper = new Paper();
  new Timeline(canvasOf(paper, 500, 200), { onPick: () => {}, onDraw: () => {} }).draw();
  assert.ok(paper.texts.includes("PATROL") && paper.texts.includes("ROUND_OF\u2026"), paper.texts.join(", "));
});

test("a run of no time fills the timeline, without instants before it", () => {
  const begun = event("Started", "/PATROL");
  store.startRun(null, [
    begun,
    { ...event("Finished", "/PATROL", { outcome: "succeeded" }), stamp_ns: begun.stamp_ns },
  ]);
  const { timeline, paper } = drawn();
  assert.equal(timeline.window.length, 20);
  assert.ok(paper.texts.includes("00:00.000"), paper.texts.join(", "));
  assert.ok(!paper.texts.some((text) => text.startsWith("-")), paper.texts.join(", "));
});

test("the axis of a machine that has not begun tells no instants", () => {
  store.startRun(null, []);
  assert.deepEqual(
    drawn().paper.texts.filter((text) => /\d/.test(text)),
    [],
  );
});

test("notes stand where they were made", () => {
  store.notes.add([{ at: (store.data.run.first() ?? 0) + 1000, text: "hit a chair" }]);
  assert.ok(drawn().paper.texts.includes("hit a chair"));
  store.notes.remove(store.notes.all.value[0]);
});

test("a wheel zooms around the instant below it", () => {
  const { timeline } = drawn();
  const { window } = timeline;
  const [from, to] = window.range();
  const middle = (from + to) / 2;
  window.zoom(0.5, middle);
  const [a, b] = window.range();
  assert.ok(Math.abs((a + b) / 2 - middle) < 1);
  assert.ok(Math.abs(2 * (b - a) - (to - from)) < 1);
  for (let i = 0; i < 99; i++) window.zoom(0.1, middle);
  assert.equal(window.length, 20); // at least
});

test("the map writes the names of goals beside them", () => {
  const goal = { target_pose: { pose: { position: { x: 3, y: 1 }, orientation: {} } } };
  const sent = { action: "/move_base", goal_id: "1", goal };
  store.addEvents([
    event("UserdataWritten", A, { key: "places", value: { kitchen: { x: 3, y: 1 } } }),
    event("Entered", A),
    event("GoalSent", A, sent),
  ]);
  const paper = new Paper();
  const map = new MapView(canvasOf(paper, 400, 300));
  map.draw();
  assert.ok(
    paper.texts.some((text) => text.includes("kitchen")),
    paper.texts.join(", "),
  );
});

test("without a map the signs of goals are whole, and a goal alone is not enlarged", () => {
  const send = (id: string, x: number) => {
    const goal = { target_pose: { pose: { position: { x, y: 1 }, orientation: {} } } };
    store.addEvents([event("Entered", A), event("GoalSent", A, { action: "/move_base", goal_id: id, goal })]);
  };
  const map = new MapView(canvasOf(new Paper(), 400, 300));
  const across = () => {
    map.draw();
    return [3, 43].map((x) => map.at({ x, y: 1 })[0]);
  };
  send("1", 3);
  const [alone, beside] = across();
  assert.equal((beside - alone) / 40, 300 / 8); // 8 m are shown
  send("2", 43);
  assert.deepEqual(across(), [20, 380]);
});

test("a night in which nothing happened is folded, and its length is told", () => {
  const night = event("Started", "/PATROL");
  night.stamp_ns += 8 * 3600e9;
  const failed = event("Entered", A);
  failed.stamp_ns = night.stamp_ns + 1e9;
  const left = { ...event("Left", A, { outcome: "aborted" }), stamp_ns: night.stamp_ns + 2e9 };
  store.addEvents([night, failed, left]);
  const { timeline, paper } = drawn();
  assert.ok(paper.texts.includes("8 h 00"), paper.texts.join(", "));
  const failures = timeline.bars.hits.filter((hit) => hit.span.path === A);
  assert.equal(failures.length, 2);
  for (const { left, right } of failures) assert.ok(right - left > 20);
  store.clock.foldIdle(false);
  assert.ok(!drawn().paper.texts.includes("8 h 00"));
  store.clock.foldIdle(true);
  store.clock.unfold(store.clock.idle()[0]);
  assert.ok(!drawn().paper.texts.includes("8 h 00"));
  store.clock.foldIdle(true);
});

test("a name that does not fit into its bar is cut with a sign, and left out if a letter would be left", () => {
  const widthOf = (text: string) => 10 * text.length;
  assert.equal(beginningOf("TRANSPORT", 60, widthOf), "TRANS\u2026");
  assert.equal(beginningOf("→ (16.9, 15.6)", 80, widthOf), "→ (16.9\u2026");
  assert.equal(beginningOf("TRANSPORT", 29, widthOf), "");
  assert.equal(beginningOf("", 60, widthOf), "");
});
