import "./browser.ts";
import assert from "node:assert/strict";
import { test } from "node:test";
import { Model } from "#core/model.ts";
import type { GoalRun, Problem, StateRun } from "#core/types.ts";
import { Diagram } from "#drawing/diagram.ts";
import { overview } from "#drawing/overview.ts";
import { Shape } from "./browser.ts";
import { fixture } from "./fixtures.ts";

const DRIVE = "/PATROL/ROUND/DRIVE";
const model = new Model(fixture("page_model.json"), false);

/** The diagram of the patrol as tiles, whose layout needs no worker. */
function drawn(problems: Problem[] = []) {
  const active: string[] = [];
  const svg = new Shape("svg") as unknown as SVGSVGElement;
  const diagram = new Diagram(svg, (path, on) => on && active.push(path));
  diagram.draw(overview(model.root, new Set(["/PATROL", "/PATROL/ROUND"]), 1.6), model, problems);
  const groupOf = (path: string) => String(diagram.picture.states.get(path)?.group);
  return { diagram, active, groupOf };
}

const running = (facts: object = {}) => ({ since: 1e9, visits: 1, ...facts }) as StateRun;

test("each state has a group with its path and its name; open containers are boxes", () => {
  const { diagram, groupOf } = drawn();
  assert.deepEqual([...diagram.picture.boxes.keys()].sort(), model.order.map((node) => node.path).sort());
  assert.match(groupOf("/PATROL/ROUND"), /^<g class="box [^"]*" data-path="\/PATROL\/ROUND" role="button"/);
  assert.match(groupOf(DRIVE), /^<g class="leaf [^"]*" data-path="\/PATROL\/ROUND\/DRIVE".*>DRIVE<\/text>/);
});

test("states lie in their containers", () => {
  const { boxes } = drawn().diagram.picture;
  const [outer, inner] = [boxes.get("/PATROL/ROUND"), boxes.get(DRIVE)];
  assert.ok(outer && inner);
  assert.ok(inner.x > outer.x && inner.y > outer.y);
  assert.ok(inner.x + inner.w <= outer.x + outer.w && inner.y + inner.h <= outer.y + outer.h);
});

test("a running state is lit, with its clock, its goal's progress and a name for screen readers", () => {
  const { diagram, active, groupOf } = drawn();
  diagram.paint(DRIVE, running(), 13_000, { progress: { fraction: 0.5 } } as GoalRun);
  assert.match(groupOf(DRIVE), /class="[^"]* active visited"/);
  assert.match(groupOf(DRIVE), />12 s<\/text>/);
  assert.match(groupOf(DRIVE), /aria-label="\/PATROL\/ROUND\/DRIVE, running"/);
  assert.equal(diagram.picture.states.get(DRIVE)?.bar?.style.transform, "scaleX(0.5)");
  assert.deepEqual(active, [DRIVE]);
});

test("a state that was left has the colour and the sign of its outcome", () => {
  const { diagram, groupOf } = drawn();
  const left = { since: null, left: 2e9, visits: 1, outcome: "aborted" } as StateRun;
  diagram.paint(DRIVE, left, 3000, null);
  assert.match(groupOf(DRIVE), /class="[^"]* was-failure"/);
  assert.match(groupOf(DRIVE), />\u2715<\/text>/);
  diagram.paint(DRIVE, left, 60_000, null);
  assert.match(groupOf(DRIVE), /was-failure faded"/);
});

test("a state that is asked to stop says for how long, and of how much", () => {
  const { diagram, groupOf } = drawn();
  diagram.paint(DRIVE, running({ preempt: 2e9, asked: { grace: 5 } }), 4000, null);
  assert.match(groupOf(DRIVE), /preempting/);
  assert.match(groupOf(DRIVE), />asked to stop 2\.0 s of 5\.0 s</);
});

test("a state with a problem has a mark", () => {
  const problem = { path: DRIVE, text: "no way out", severity: "error" } as Problem;
  assert.match(drawn([problem]).groupOf(DRIVE), /class="leaf [^"]*problem".*<circle class="warning failure"/);
});

test("marks move from one state to another", () => {
  const { diagram, groupOf } = drawn();
  diagram.mark([DRIVE], "selected");
  diagram.mark(["/PATROL/DOCK"], "selected");
  assert.doesNotMatch(groupOf(DRIVE), /selected/);
  assert.match(groupOf("/PATROL/DOCK"), /selected/);
});
