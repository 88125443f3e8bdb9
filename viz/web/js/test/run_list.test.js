import assert from "node:assert/strict";
import { test } from "node:test";
import { beganText, chosen, countsOf, filterText, secondsOf, standing, tally } from "#core/run_list.js";

/** @param {string} id @param {Partial<RunRow>} [facts] @returns {RunRow} */
const row = (id, facts = {}) => ({
  id,
  name: null,
  machine: "JOB",
  robots: [],
  live: false,
  began: 1e9,
  ended: 3e9,
  last: 3e9,
  outcome: "succeeded",
  reason: "",
  problem: "",
  file: "",
  strip: [],
  ...facts,
});
const ROWS = [
  row("a", { outcome: "aborted", reason: "DRIVE: goal lost", robots: ["robot_0"] }),
  row("b", { machine: "PATROL", strip: [[0, "DOCK", 0, 1, "success"]] }),
  row("c", { live: true, outcome: null, ended: null, robots: ["robot_0", "robot_1"] }),
  row("d", { outcome: null, ended: null }),
  row("e", { outcome: "preempted" }),
];
const ALL = { show: "all", machine: null, robot: null, text: "" };
const ids = (/** @type {object} */ filter, pins = new Set()) =>
  chosen(ROWS, { ...ALL, ...filter }, pins)
    .map(({ id }) => id)
    .join("");

test("a run stands as its outcome, live, or without an end", () => {
  assert.deepEqual(ROWS.map(standing), ["failure", "success", "live", "cut", "preempted"]);
});

test("live runs come first, then pinned ones, then as they came", () => {
  assert.equal(ids({}), "cabde");
  assert.equal(ids({}, new Set(["e"])), "ceabd");
});

test("filters choose together", () => {
  assert.equal(ids({ show: "failure" }), "a");
  assert.equal(ids({ show: "pinned" }, new Set(["b", "gone"])), "b");
  assert.equal(ids({ robot: "robot_0" }), "ca");
  assert.equal(ids({ machine: "PATROL", show: "failure" }), "");
  assert.equal(ids({ text: "GOAL drive" }), "a");
  assert.equal(ids({ text: "dock" }), "b");
  assert.equal(ids({ text: "  " }), "cabde");
  assert.equal(filterText({ ...ALL, show: "failure", machine: "PATROL" }), "failed and of PATROL");
});

test("runs are counted by what they can be chosen by", () => {
  const counts = countsOf(ROWS, new Set(["a"]));
  assert.deepEqual([counts.get("all"), counts.get("live"), counts.get("pinned"), counts.get("other")], [5, 1, 1, 0]);
  assert.deepEqual(
    tally(ROWS, (one) => one.robots),
    [
      ["robot_0", 2],
      ["robot_1", 1],
    ],
  );
  assert.deepEqual(
    tally(ROWS, () => ["__proto__"]),
    [["__proto__", 5]],
  );
});

test("how long a run took, or runs", () => {
  assert.deepEqual(
    ROWS.map((one) => secondsOf(one, 11_000)),
    [2, 2, 10, 2, 2],
  );
  assert.equal(secondsOf(row("x", { began: null }), 0), null);
});

test("today has hours, other days are dates", () => {
  const today = new Date(2026, 4, 1, 12, 0);
  assert.equal(beganText(today.getTime() * 1e6, today), "12:00");
  assert.equal(beganText(new Date(2026, 3, 1).getTime() * 1e6, today), "1 Apr 2026");
});
