import assert from "node:assert/strict";
import { test } from "node:test";
import { placed } from "#core/good_runs.ts";

test("good values and this one lie on one line, with the middle of the good ones as a box", () => {
  const line = placed({ good: [5, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11], number: 21 });
  assert.deepEqual([line?.low, line?.high], [1, 21]);
  assert.ok(line && line.here > line.box[1] && line.here < 1 && line.dots[0] > 0);
  const rounded = line?.box.map((x) => Math.round(x * 1000));
  assert.deepEqual(rounded, [112, 457]);
  assert.equal(placed({ good: [], number: 1 }), null);
  assert.equal(placed({ good: [1], number: null }), null);
  assert.ok(placed({ good: [0, 0], number: 0 })?.dots.every(Number.isFinite));
});
