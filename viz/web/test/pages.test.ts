import assert from "node:assert/strict";
import { test } from "node:test";
import { addressOf, pageOf } from "#core/pages.ts";

test("each page has an address, and is found by it", () => {
  const from = "http://x:1/?machine=robot_1%2Fjob#at=5";
  assert.equal(addressOf(from, "machine"), from);
  for (const name of ["runs", "fleet", "actions", "simulate", "machine"] as const)
    assert.equal(pageOf(new URL(addressOf(from, name)).search), name);
  const runs = addressOf(from, "runs");
  assert.equal(addressOf(runs, "machine"), from);
  assert.equal(pageOf(new URL(addressOf(runs, "actions")).search), "actions");
});

test("another machine begins with a view of its own", () => {
  assert.equal(addressOf("http://x:1/?runs=&machine=a#at=5", "machine", "b/c"), "http://x:1/?machine=b%2Fc");
  assert.equal(addressOf("http://x:1/?machine=a#at=5", "machine", "a"), "http://x:1/?machine=a#at=5");
  assert.equal(pageOf("?machine=runs"), "machine");
});
