import "./browser.ts";
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import type { VNode } from "preact";
import { renderToString } from "preact-render-to-string";
import { setToken } from "#core/requests.ts";
import { store } from "#core/store.ts";
import type { Cause, Observed } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { Goals } from "#panels/goals.tsx";
import { HomePage } from "#panels/home.tsx";
import { Inspector } from "#panels/inspector.tsx";
import { Log } from "#panels/log.tsx";
import { MapPanel } from "#panels/map.tsx";
import { PlayBar } from "#panels/play.tsx";
import { Preempts } from "#panels/preempts.tsx";
import { SimulatePage } from "#panels/simulate.tsx";
import { TopBar } from "#panels/top_bar.tsx";
import { Tree } from "#panels/tree.tsx";
import { Userdata } from "#panels/userdata.tsx";
import { WhyPanel } from "#panels/why.tsx";
import { event, FACTS, fixture } from "./fixtures.ts";

const page = {} as Page; // only handlers use it

/** What people read, a line for each of some elements. */
function lines(panel: VNode, elements = "li|p|div|button|h[1-3]|section|tr|option|label") {
  const html = renderToString(panel);
  const parts = html.split(new RegExp(`</?(?:${elements})\\b[^>]*>`));
  const plain = parts.map((part) => part.replace(/<[^>]*>/g, " ").replace(/\s+/g, " "));
  return plain.map((part) => part.trim()).filter(Boolean);
}

const goal = { action: "/drive", goal_id: "1", goal: { $object: "Goal", fields: { name: "kitchen" } } };

beforeEach(() => {
  store.data.connection.value = "live";
  store.data.facts.value = { ...FACTS, label: "PATROL" };
  store.view.setModel(fixture("page_model.json"));
  store.startRun(null, [
    event("Started", "/PATROL"),
    event("Entered", "/PATROL/ROUND"),
    event("Entered", "/PATROL/ROUND/DRIVE"),
    event("GoalSent", "/PATROL/ROUND/DRIVE", goal),
    event("UserdataWritten", "/PATROL/ROUND/DRIVE", { key: "battery", value: 0.5 }),
  ]);
  store.data.why.value = null;
  store.data.problems.value = [];
  store.playback.renew();
});

test("the log has a line for each event, the newest first, with the time since the begin", () => {
  assert.deepEqual(lines(<Log page={page} />, "li").slice(1), [
    "00:03.00 DRIVE goal to /drive \u2192 kitchen",
    "00:00.00 PATROL started",
  ]);
});

test("the log escapes what a mission says", () => {
  store.addEvents([event("Failed", "/PATROL/ROUND/DRIVE", { error: "<img src=x onerror=alert(1)>" })]);
  const html = renderToString(<Log page={page} />);
  assert.ok(!html.includes("<img"));
  assert.ok(html.includes("&lt;img src=x"));
});

test("the tree has a row for each state of an open container, and says what runs and what for", () => {
  store.view.setOpened(new Set(["/PATROL"]));
  const rows = ["\u25be PATROL", "\u25be ROUND", "\u00b7 DRIVE \u2192 kitchen", "\u00b7 BATTERY", "\u00b7 DOCK"];
  assert.deepEqual(lines(<Tree page={page} />, "div"), rows);
  assert.match(
    renderToString(<Tree page={page} />),
    /role="treeitem"[^>]*title="\/PATROL\/ROUND\/DRIVE"[^>]*class="row active"/,
  );
});

test("a running goal says its action, how long it runs and what it is", () => {
  const now = (store.data.run.last() ?? 0) + 10_000;
  const goals = lines(<Goals page={page} data={store.playback.shown()} now={now} />);
  assert.deepEqual(goals, ["Goals", "DRIVE", "/drive \u2192 kitchen 11 s", "active", "goal"]);
});

test("an ended goal is one line with its text and its time", () => {
  const done = { goal_id: "1", status: "ABORTED", text: "no way", result: null };
  store.addEvents([event("GoalDone", "/PATROL/ROUND/DRIVE", done)]);
  const html = lines(<Goals page={page} data={store.playback.shown()} now={store.data.run.last() ?? 0} />);
  assert.ok(
    html.some((one) => one.includes("\u2192 kitchen no way") && one.includes("2.0 s")),
    html.join("\n"),
  );
});

test("a value of userdata says who wrote it, and when", () => {
  const panel = <Userdata page={page} data={store.playback.shown()} now={store.data.run.last() ?? 0} />;
  assert.deepEqual(lines(panel), ["Userdata 1", "battery", "0.5 by", "DRIVE", "at 00:04.00"]);
});

test("the play bar stands at the instant shown, and says which jumps lead nowhere", () => {
  store.playback.seek((store.data.run.first() ?? 0) + 1000);
  const html = renderToString(<PlayBar page={page} />);
  assert.match(html, /value="00:01\.0"/);
  assert.match(html, /aria-disabled="true"[^>]*title="none ahead \(f\)/);
  assert.match(html, /aria-disabled="false"[^>]*title="go there \(g\)/);
});

test("before a run there is no play bar", () => {
  store.startRun(null, []);
  assert.equal(renderToString(<PlayBar page={page} />), "");
});

test("a preempt names who asked and who holds it up", () => {
  const asked = { source: "operator", by: "ann", why: "stop", grace: 5 };
  store.addEvents([event("PreemptRequested", "/PATROL/ROUND/DRIVE", asked)]);
  const text = lines(
    <Preempts page={page} data={store.playback.shown()} now={(store.data.run.last() ?? 0) + 2000} />,
  ).join("\n");
  assert.match(text, /operator ann/);
  assert.match(text, /2\.0 s of 5\.0 s/);
});

test("the causes of an end are a list, the first one marked", () => {
  const step: Cause = {
    path: "/PATROL/ROUND/DRIVE",
    outcome: "aborted",
    stamp_ns: 1e9,
    what: "goal aborted",
    kind: "failure",
    reason: "no way",
    detail: "",
    read: [["goal", "'dock'", "/PATROL/ROUND", 5e8]],
    written: [["battery", "0.1", "0.5"]],
  };
  store.data.why.value = { label: "PATROL", outcome: "aborted", began: 0, ended: 1, steps: [step], text: "" };
  const html = renderToString(<WhyPanel page={page} />);
  assert.match(html, /<li class="failure first">/);
  assert.match(html, /read <b>goal<\/b> 'dock'/);
  assert.match(html, /wrote <b>battery<\/b> 0\.1 <small>\(was 0\.5\)/);
  store.data.why.value = null;
  assert.equal(renderToString(<WhyPanel page={page} />), "");
});

test("the list of runs is drawn only where it is on view", () => {
  assert.equal(renderToString(<HomePage />), "");
  store.view.pageShown.value = "runs";
  store.data.runsKnown.value = true;
  assert.match(renderToString(<HomePage />), /No runs yet/);
  store.view.pageShown.value = "machine";
});

test("the top bar says how the run stands, and where", () => {
  const bar = ["running", "PATROL", "\u203a", "ROUND", "\u203a", "DRIVE"];
  assert.deepEqual(lines(<TopBar page={page} />).slice(3, 9), bar);
  store.data.connection.value = "lost";
  assert.equal(lines(<TopBar page={page} />)[3], "reconnecting");
});

test("the inspector says what is wrong with the machine", () => {
  store.data.problems.value = [{ rule: "stuck", severity: "error", path: "/PATROL", text: "no way out" }];
  assert.ok(lines(<Inspector page={page} />).some((line) => line.includes("no way out")));
});

test("simulated runs start when the missions are known", () => {
  setToken("t");
  const { settings, simulations, simulationsKnown } = store.data;
  settings.value = { ...settings.value, control: true };
  store.view.pageShown.value = "simulate";
  const starts = () => /<button[^>]*type="submit"[^>]*>/.exec(renderToString(<SimulatePage />))?.[0] ?? "";
  assert.match(renderToString(<SimulatePage />), /<option[^>]*>reading the missions\u2026/);
  assert.match(starts(), /disabled/);
  simulationsKnown.value = true;
  assert.match(renderToString(<SimulatePage />), /<option[^>]*>none installed/);
  assert.match(starts(), /disabled/);
  simulations.value = { missions: { patrol: "" }, batches: [] };
  assert.doesNotMatch(starts(), /disabled/);
  store.view.pageShown.value = "machine";
});

test("the bar says what evidence the run has, and whether it did what nobody has tried", () => {
  const chip = () =>
    /data-testid="seal">(.*?)<\/span><\/span>/.exec(renderToString(<TopBar page={page} />))?.[1]?.replace(/<.*>/, "");
  assert.equal(chip(), undefined);
  const said: [string, string | undefined][] = [
    ["aisle 7", undefined],
    ["evidence: valid, e.json; hash 12", "✓ certified"],
    ["evidence: nothing that was tried has taken /PATROL/ROUND -aborted->", "⚠ not tried"],
    ["evidence: none of this mission; hash 12", "⚠ no evidence"],
  ];
  for (const [text, word] of said) {
    store.addEvents([event("Noted", "/PATROL", { text })]);
    assert.equal(chip(), word);
  }
});

test("each robot can be kept in the middle of the map, however many they are", () => {
  const shown = (count: number) => {
    const at = [0, 0, 0];
    const names = Array.from({ length: count }, (_, i) => `robot_${i}`);
    const poses = names.map((robot, i) => ({
      ...{ kind: "Observed", path: "", n: i + 1, stamp_ns: 1e18, what: "pose", robot, at },
    }));
    store.startRun(null, []);
    store.data.addObserved(poses as Observed[]);
    return lines(<MapPanel page={{ map: { followed: null } } as Page} />);
  };
  assert.deepEqual(shown(2).slice(-3), ["Whole", "robot_0", "robot_1"]);
  assert.ok(!renderToString(<MapPanel page={{ map: { followed: null } } as Page} />).includes("<select"));
  assert.deepEqual(shown(3).slice(-4), ["Whole", "robot_0", "robot_1", "robot_2"]);
  assert.match(renderToString(<MapPanel page={{ map: { followed: "robot_1" } } as Page} />), /selected[^>]*>robot_1/);
});
