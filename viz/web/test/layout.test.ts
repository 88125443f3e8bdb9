import assert from "node:assert/strict";
import { test } from "node:test";
import { Layout } from "#drawing/layout.ts";
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

test("a layout is for the view that there is, also for the low and wide one of a phone held sideways", () => {
  const layout = new Layout({ postMessage: () => {} } as unknown as Worker);
  layout.choose(4.2);
  assert.equal(layout.aspect, 4.2);
  assert.equal(layout.suits(2.4), false);
});
