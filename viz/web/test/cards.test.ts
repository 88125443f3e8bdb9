import assert from "node:assert/strict";
import { test } from "node:test";
import { hasManyBranches, Model } from "#core/model.ts";
import type { MachinePayload, StateNode } from "#core/types.ts";
import { cards, waysOf } from "#drawing/cards.ts";
import { bundlesOf } from "#drawing/shapes.ts";

// Node.js has no fonts: each character is 6 px wide.
const context = { font: "", measureText: (text: string) => ({ width: 6 * text.length }) };
Object.assign(globalThis, { document: { createElement: () => ({ getContext: () => context }) } });

const node = (label: string, kind: string, more: object = {}) => ({
  ...{ path: `/M/${label}`, label, kind, type_name: "", doc: "", details: [], outcomes: ["done", "failed"] },
  ...{ hidden: 0, children: [], initial: [], edges: [], rules: [], default_outcome: null, pills: [], change: "" },
  ...{ note: "", caption: "", tokens: 0, ...more },
});
const edge = (source: string, target: string, outcome = target) => ({
  ...{ source, target, to_outcome: true, outcomes: [outcome], implicit: false, back: false, change: "", note: "" },
});

function machine(count: number, kind: string, more: object) {
  const labels = Array.from({ length: count }, (_, i) => `B${i}`);
  const children = labels.map((label) => node(label, "state"));
  const root = node("", kind, { path: "/M", children, ...more });
  const payload = { explicit: root, implicit: root, keys: {} } as unknown as MachinePayload;
  return { labels, top: new Model(payload, false).root };
}
const inside = (one: { x: number; y: number; w: number; h: number }, { w, h }: { w: number; h: number }) =>
  one.x >= 0 && one.y >= 0 && one.x + one.w <= w && one.y + one.h <= h;

function wide(count: number): StateNode {
  const conditions = Array.from({ length: count }, (_, i) => [`B${i}`, "done"]);
  const rules = [{ outcome: "done", conditions, text: `20 of ${count}`, change: "" }];
  const edges = conditions.map(([label]) => edge(label, "failed"));
  return machine(count, "concurrence", { rules, edges }).top;
}

test("seven branches of a concurrence are cards", () => {
  assert.equal(hasManyBranches(wide(7)), true);
  assert.equal(hasManyBranches(wide(6)), false);
  assert.equal(hasManyBranches(machine(9, "machine", {}).top), false);
});

test("one bracket carries a rule of many, and what any branch decides", () => {
  const ways = waysOf(wide(30));
  assert.deepEqual(
    ways.map(({ outcome, text, also }) => [outcome, text, also?.length ?? 1]),
    [
      ["done", "20 of 30: 19 of 20", 1],
      ["failed", "any of 30", 30],
    ],
  );
});

for (const outer of [null, "DOWN", "RIGHT"] as const)
  test(`cards do not overlap, and nothing leaves the container (${outer})`, () => {
    const layout = cards(wide(30), outer, 1.6);
    assert.equal(layout.boxes.length, 30);
    for (const [i, a] of layout.boxes.entries()) {
      assert.ok(inside(a, layout));
      for (const b of layout.boxes.slice(i + 1))
        assert.ok(a.x + a.w <= b.x || b.x + b.w <= a.x || a.y + a.h <= b.y || b.y + b.h <= a.y);
    }
    assert.equal(layout.joins.length, 1);
    const [bracket] = layout.joins;
    assert.ok(layout.boxes.every((box) => box.x + box.w < bracket.x));
    for (const { points } of layout.edges) {
      assert.equal(points[0].x, bracket.x + bracket.w);
      for (const [i, { x, y }] of points.slice(1).entries())
        assert.ok(x === points[i].x || y === points[i].y, "arrows are level or upright");
    }
    const [one, other] = layout.pills;
    assert.ok(one.x + one.w <= other.x || one.y + one.h <= other.y || other.y + other.h <= one.y);
  });

test("transitions of six states to one outcome are a bundle", () => {
  const { labels, top } = machine(8, "machine", {});
  const ways = (some: string[]) => some.map((label) => ({ ...edge(label, "failed"), rule: null, join: null }));
  top.links = [...ways(labels.slice(0, 6)), { ...edge("B0", "done"), rule: null, join: null }];
  assert.deepEqual([...bundlesOf(top).values()], [6, 6, 6, 6, 6, 6]);
  top.links = ways(labels.slice(0, 5));
  assert.equal(bundlesOf(top).size, 0);
  top.links = ways(labels).map((link) => ({ ...link, change: "added" }));
  assert.equal(bundlesOf(top).size, 0); // where two versions are compared, each arrow counts
});
