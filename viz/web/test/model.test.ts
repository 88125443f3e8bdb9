import assert from "node:assert/strict";
import { test } from "node:test";
import { joinText, Model } from "#core/model.ts";
import type { Join, StateNode } from "#core/types.ts";
import { fixture } from "./fixtures.ts";

const model = (implicit = false) => new Model(fixture("page_model.json"), implicit);

test("every state can be found by its path, parents first", () => {
  assert.deepEqual(
    model().order.map((node) => [node.path, node.depth, node.total]),
    [
      ["/PATROL", 0, 5],
      ["/PATROL/ROUND", 1, 3],
      ["/PATROL/ROUND/DRIVE", 2, 1],
      ["/PATROL/ROUND/BATTERY", 2, 1],
      ["/PATROL/DOCK", 1, 1],
    ],
  );
  assert.equal(model().get("/PATROL/ROUND/DRIVE")?.parent?.label, "ROUND");
  assert.equal(model().get(null), undefined);
  assert.deepEqual(
    model()
      .ancestors("/PATROL/ROUND/DRIVE")
      .map((node) => node.label),
    ["PATROL", "ROUND"],
  );
});

test("rules of a concurrence are arrows", () => {
  const links = model().get("/PATROL/ROUND")?.links ?? [];
  assert.deepEqual(
    links.map((link) => [link.source, link.outcomes, link.target]),
    [
      ["DRIVE", ["succeeded"], "all"],
      ["BATTERY", ["low"], "low"],
    ],
  );
  assert.deepEqual(model().get("/PATROL/ROUND/DRIVE")?.wired, ["succeeded"]);
});

test("transitions that nobody wrote down are shown when asked for", () => {
  const targets = (one: Model) => {
    const node = one.get("/PATROL/DOCK") as StateNode;
    return node.outcomes.map((outcome) => one.linkOf(node, outcome)?.target);
  };
  assert.deepEqual(targets(model()), ["ROUND", undefined]);
  assert.deepEqual(targets(model(true)), ["ROUND", "aborted"]);
});

test("search finds all words in any order, names that begin with the first one first", () => {
  const found = (text: string) =>
    model()
      .search(text)
      .map((node) => node.label);
  assert.deepEqual(found("r"), ["ROUND", "PATROL", "DRIVE", "BATTERY", "DOCK"]);
  assert.deepEqual(found("drive round"), ["DRIVE"]);
  assert.deepEqual(found("nowhere"), []);
  assert.deepEqual(found("  "), []);
});

test("levels", () => {
  assert.deepEqual([...model().toDepth(1)], ["/PATROL"]);
  assert.deepEqual([...model().toDepth(9)], ["/PATROL", "/PATROL/ROUND"]);
  assert.equal(model().readableDepth(), 2);
  assert.equal(model().readableDepth(4), 1);
});

function ruled(text: string, conditions: [string, string][]) {
  const payload = fixture("page_model.json");
  payload.explicit.children[0].rules = [{ outcome: "low", conditions, text, change: "" }];
  return new Model(payload, false).get("/PATROL/ROUND") as StateNode;
}

test("the arrows of a rule over several children end at one bar", () => {
  const node = ruled("BATTERY:low, DRIVE:preempted", [
    ["BATTERY", "low"],
    ["DRIVE", "preempted"],
    ["GONE", "x"], // no child
  ]);
  assert.deepEqual(
    node.joins.map(({ outcome, need, conditions }) => [outcome, need, conditions.length]),
    [["low", 2, 2]],
  );
  assert.deepEqual(
    node.links.map((link) => [link.source, link.outcomes, link.target, link.join]),
    [
      ["BATTERY", ["low"], "low", 0],
      ["DRIVE", ["preempted"], "low", 0],
    ],
  );
});

test("a rule of one child, and one that any child decides, have no bar", () => {
  const both: [string, string][] = [
    ["BATTERY", "low"],
    ["DRIVE", "preempted"],
  ];
  assert.deepEqual(ruled("BATTERY:low", [both[0]]).joins, []);
  const any = ruled("any of BATTERY:low, DRIVE:preempted", both);
  assert.deepEqual(any.joins, []);
  assert.deepEqual(
    any.links.map((link) => link.join),
    [null, null],
  );
  assert.equal(ruled("1 of them", both).joins[0].need, 1);
});

test("a bar says what it needs, and while it waits what has come", () => {
  const join = (need: number, all: number) => ({ need, conditions: Array(all).fill(["A", "ok"]) }) as Join;
  assert.deepEqual(
    [0, 1, 2].map((come) => joinText(join(2, 2), come)),
    ["both", "both: 1 of 2", "both"],
  );
  assert.equal(joinText(join(5, 5), 3), "all 5: 3 of 5");
  assert.equal(joinText(join(2, 5), 1), "2 of 5: 1 of 2");
});
