import assert from "node:assert/strict";
import { test } from "node:test";
import { Axis, idleIn } from "#core/idle.ts";
import type { RunEvent } from "#core/types.ts";

const HOUR = 3_600_000;
const events = (...instants: number[]) =>
  instants.map((t, i) => ({ kind: "Iterated", path: "/M", seq: i, t: 0, stamp_ns: t * 1e6 }) as RunEvent);
const each = (from: number, to: number, step: number) =>
  Array.from({ length: Math.floor((to - from) / step) }, (_, i) => from + i * step);

test("a night between two runs is idle, and pauses of minutes in hours are not", () => {
  const busy = [...each(0, 2 * HOUR, 60_000), ...each(10 * HOUR, 12 * HOUR, 360_000)];
  assert.deepEqual(idleIn(events(...busy)), [{ from: 2 * HOUR - 60_000, to: 10 * HOUR }]);
  assert.deepEqual(idleIn(events(...each(0, 5 * HOUR, 360_000))), []);
  assert.deepEqual(idleIn(events(0, 299_999)), []);
  assert.deepEqual(idleIn([]), []);
});

test("shorter idle times are seen once the longest ones are folded", () => {
  const week = 168 * HOUR;
  const found = idleIn(events(...each(0, HOUR, 60_000), 3 * HOUR, week, ...each(week, week + HOUR, 60_000)));
  assert.deepEqual(
    found.map(({ to }) => to),
    [3 * HOUR, week],
  );
});

test("the axis leads there and back, and beyond its range", () => {
  const folds = [
    { from: 100, to: 900_100 },
    { from: 900_300, to: 1_800_300 },
  ];
  const axis = new Axis(folds, { from: 0, to: 1_800_500 }, 50, 1050);
  assert.deepEqual([axis.x(0), Math.round(axis.x(1_800_500))], [50, 1050]);
  assert.ok(Math.abs(axis.x(900_100) - axis.x(100) - 44) < 1e-6);
  for (const t of [-200, 0, 50, 100, 450_000, 900_200, 1_000_000, 1_800_400, 1_900_000])
    assert.ok(Math.abs(axis.timeAt(axis.x(t)) - t) < 1e-3, `${t}`);
  let before = -Infinity;
  for (let t = -1000; t < 1_900_000; t += 777) {
    assert.ok(axis.x(t) > before);
    before = axis.x(t);
  }
  assert.equal(axis.foldAt(axis.x(500_000)), folds[0]);
  assert.equal(axis.foldAt(axis.x(900_200)), null);
});

test("a range inside an idle time is shown as it is, and many folds leave room for the rest", () => {
  const inside = new Axis([{ from: 0, to: HOUR }], { from: 1000, to: 2000 }, 0, 100);
  assert.deepEqual([inside.x(1500), inside.folds], [50, []]);
  const many = Array.from({ length: 19 }, (_, i) => ({ from: i * HOUR + 1000, to: (i + 1) * HOUR }));
  const axis = new Axis(many, { from: 0, to: 20 * HOUR }, 0, 300);
  const folded = many.reduce((sum, { from, to }) => sum + axis.x(to) - axis.x(from), 0);
  assert.ok(folded <= 101, `${folded}`);
});
