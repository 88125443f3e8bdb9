import assert from "node:assert/strict";
import { test } from "node:test";
import { Model } from "#core/model.js";
import { fixture } from "./fixtures.js";

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
  const targets = (/** @type {Model} */ one) => {
    const node = /** @type {StateNode} */ (one.get("/PATROL/DOCK"));
    return node.outcomes.map((outcome) => one.linkOf(node, outcome)?.target);
  };
  assert.deepEqual(targets(model()), ["ROUND", undefined]);
  assert.deepEqual(targets(model(true)), ["ROUND", "aborted"]);
});

test("search finds all words in any order, names that begin with the first one first", () => {
  const found = (/** @type {string} */ text) =>
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
