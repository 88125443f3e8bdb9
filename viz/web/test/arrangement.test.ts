import assert from "node:assert/strict";
import { test } from "node:test";
import * as arrangement from "#core/arrangement.ts";

const WORD = "tree|map:312,details|time,plots|208:416";

test("an arrangement is one word", () => {
  assert.equal(arrangement.wordOf(arrangement.usual()), WORD);
  assert.deepEqual(arrangement.arrangementOf(WORD), arrangement.usual());
  const other = "|details,map|plots:90|300:500";
  const found = arrangement.arrangementOf(other);
  assert.ok(found);
  assert.equal(arrangement.wordOf(found), other);
  assert.equal(arrangement.placeOf(found, "tree"), null); // hidden
  assert.equal(arrangement.wordOf(arrangement.arrangementOf("tree:1|||1:9999") as any), "tree:56|||120:1200");
});

test("what is no arrangement is none", () => {
  for (const odd of [
    null,
    5,
    "",
    "tree",
    "a|b|c|1:2",
    "tree,tree|||1:2",
    "tree:x|||1:2",
    "tree|||",
    "tree|||1",
    "tree|||1:2|3",
  ])
    assert.equal(arrangement.arrangementOf(odd), null, String(odd));
  assert.equal(arrangement.arrangementOf(`${"tree,".repeat(99)}|||1:2`), null);
  assert.equal(arrangement.arrangementOf("constructor|||1:2"), null);
});

test("panels move between docks and within one, and can be hidden", () => {
  const { moved, usual, wordOf } = arrangement;
  const word = (...how: any[]) => wordOf(moved(usual(), ...(how as [any, any])));
  assert.equal(word("plots", "right", 1), "tree|map:312,plots,details|time|208:416");
  assert.equal(word("map", "right", 2), "tree|details,map:312|time,plots|208:416"); // it keeps its height
  assert.equal(word("map", "right", 1), WORD); // before itself is where it is
  assert.equal(word("map", "bottom", 0), "tree|details|map,time,plots|208:416");
  assert.equal(word("tree", null), "|map:312,details|time,plots|208:416");
  assert.equal(wordOf(moved(moved(usual(), "tree", null), "tree", "left")), WORD);
  assert.equal(wordOf(usual()), WORD); // nothing changes in place
});

test("sizes have limits", () => {
  const { resized, usual, widened, wordOf } = arrangement;
  assert.equal(wordOf(resized(usual(), "details", 99.6)), "tree|map:312,details:100|time,plots|208:416");
  assert.equal(wordOf(resized(usual(), "map", -5)), "tree|map:56,details|time,plots|208:416");
  assert.equal(wordOf(widened(usual(), "right", 5000)), "tree|map:312,details|time,plots|208:1200");
});

test("a panel is dropped into the dock under the pointer, else the nearest one", () => {
  const box = (...[x, y, w, h]: number[]) => ({ x, y, w, h });
  const docks = [
    { dock: "left" as const, box: box(0, 50, 200, 500), panels: [box(0, 50, 200, 500)] },
    {
      dock: "right" as const,
      box: box(1000, 50, 400, 750),
      panels: [box(1000, 50, 400, 300), box(1000, 350, 400, 450)],
    },
  ];
  const drop = (x: number, y: number) => arrangement.dropAt({ x, y }, docks, { w: 1400, h: 800 });
  assert.deepEqual(drop(1100, 60), { dock: "right", index: 0 });
  assert.deepEqual(drop(1100, 300), { dock: "right", index: 1 });
  assert.deepEqual(drop(1100, 790), { dock: "right", index: 2 });
  assert.deepEqual(drop(700, 750), { dock: "bottom", index: 0 }); // it is empty
  assert.deepEqual(drop(250, 400), { dock: "left", index: 1 });
});
