import assert from "node:assert/strict";
import { test } from "node:test";
import { isSound } from "#drawing/results.ts";

const layout = (...lines: [number, number][][]) =>
  ({ edges: lines.map((points) => ({ points: points.map(([x, y]) => ({ x, y })) })) }) as any;

test("a layout with an arrow across the drawing is wrong", () => {
  assert.equal(isSound(layout()), true);
  assert.equal(
    isSound(
      layout([
        [0, 0],
        [0, 50],
        [80, 50.4],
      ]),
    ),
    true,
  );
  assert.equal(
    isSound(
      layout(
        [
          [0, 0],
          [0, 50],
        ],
        [
          [0, 0],
          [40, 60],
        ],
      ),
    ),
    false,
  );
});
