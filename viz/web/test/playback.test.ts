import assert from "node:assert/strict";
import { test } from "node:test";
import { framesOf, instantAt, loopedAt, Marks, parseInstant } from "#core/playback.ts";
import { keepUnchanged } from "#drawing/film_worker.ts";
import { event } from "./fixtures.ts";

test("a film shows its stretch at 5 pictures a second, a long one faster", () => {
  assert.deepEqual(framesOf({ from: 1000, to: 1500 }), [1000, 1200, 1400, 1500]);
  assert.deepEqual(framesOf({ from: 7, to: 7 }), [7, 7]);
  const long = framesOf({ from: 0, to: 3_600_000 });
  assert.equal(long.length, 151);
  assert.equal(long.at(-1), 3_600_000);
});

test("what is as it was costs nothing in a film", () => {
  const indexes = new Uint8Array([1, 2, 3]);
  assert.equal(keepUnchanged(new Uint32Array([5, 6, 7]), new Uint32Array([5, 9, 7]), indexes, 255), true);
  assert.deepEqual([...indexes], [255, 2, 255]);
  assert.equal(keepUnchanged(new Uint32Array([5]), new Uint32Array([5]), new Uint8Array(1), 255), false);
});

test("a loop begins anew where its stretch ends, and plays what is before it first", () => {
  const stretch = { from: 100, to: 300 };
  assert.deepEqual(
    [50, 100, 299, 300, 350, 1100].map((t) => loopedAt(t, stretch)),
    [50, 100, 299, 100, 150, 100],
  );
  assert.equal(loopedAt(5, { from: 5, to: 5 }), 5);
});

test("an instant is typed as it is shown, or in seconds", () => {
  const read = ["32.5", " 00:32.0 ", "01:02", "1:02:03.25", "90:00", "0"].map(parseInstant);
  assert.deepEqual(read, [32.5, 32, 62, 3723.25, 5400, 0]);
  for (const text of ["", "now", "-1", "1:2:3:4", "1e5", "0x10", "NaN", ":30", "1.", `${"9".repeat(30)}`])
    assert.equal(parseInstant(text), text === "1." ? 1 : null, text);
});

test("what plays runs at its rate", () => {
  assert.equal(instantAt({ t: 1000, since: 50, rate: 4 }, 300), 2000);
  assert.equal(instantAt({ t: 1000, since: 50, rate: 0.25 }, 450), 1100);
});

const MODEL: any = {
  get: (path: string) =>
    ({
      "/M": { kind: "machine", children: [1] },
      "/M/GO": { kind: "action", children: [] },
      "/M/WATCH": { kind: "monitor", children: [] },
    })[path],
};

function run() {
  const { stamp_ns } = event("Started", "/M");
  const at = (s: number, kind: string, path: string, facts = {}) =>
    event(kind, path, { ...facts, stamp_ns: stamp_ns + s * 1e9 });
  return [
    at(0, "Started", "/M"), // 1
    at(1, "GoalSent", "/M/GO"), // 2
    at(2, "Left", "/M/WATCH", { outcome: "invalid" }), // 3: what a monitor finds is no failure
    at(3, "PreemptRequested", "/M/GO"), // 4
    at(3, "PreemptRequested", "/M/WATCH"), // 5: the same preempt
    at(4, "GoalDone", "/M/GO", { status: "ABORTED" }), // 6
    at(5, "Left", "/M/GO", { outcome: "aborted" }), // 7
    at(5, "Left", "/M", { outcome: "aborted" }), // 8: hands on what failed in it
    at(6, "UserdataWritten", "/M/GO", { key: "constructor" }), // 9
    at(7, "UserdataWritten", "/M/GO", { key: "constructor" }), // 10
    at(8, "Failed", "/M/GO", { error: "x" }), // 11
  ];
}

function all(marks: Marks, name: string, from: number, step: number) {
  const found = [];
  for (let at = marks.find(name, from, step, MODEL); at !== null; at = marks.find(name, at, step, MODEL))
    found.push(at);
  return found;
}

test("one goes from mark to mark, and back", () => {
  const marks = new Marks();
  marks.push(run());
  assert.deepEqual(all(marks, "kind failure", 0, 1), [6, 7, 11]);
  assert.deepEqual(all(marks, "kind failure", 12, -1), [11, 7, 6]);
  assert.deepEqual(all(marks, "kind preempt", 0, 1), [4]);
  assert.deepEqual(all(marks, "kind goal", 0, 1), [2]);
  assert.deepEqual(all(marks, "key constructor", 0, 1), [9, 10]);
  assert.deepEqual(all(marks, "key toString", 0, 1), []);
  assert.deepEqual([...marks.keys], ["constructor"]);
});

test("what the run has forgotten is no mark any more", () => {
  const marks = new Marks();
  marks.push(run());
  marks.forget(5);
  assert.deepEqual(all(marks, "kind failure", 0, 1), [1, 2, 6]);
  assert.deepEqual(all(marks, "kind goal", 0, 1), []);
  marks.push([event("GoalSent", "/M/GO")]);
  assert.deepEqual(all(marks, "kind goal", 0, 1), [7]);
});
