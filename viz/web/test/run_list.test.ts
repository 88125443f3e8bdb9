import assert from "node:assert/strict";
import { test } from "node:test";
import {
  beganText,
  chosen,
  countsOf,
  filterText,
  outageText,
  pinOf,
  secondsOf,
  standing,
  tally,
} from "#core/run_list.ts";
import type { Mission, RunRow } from "#core/types.ts";

const row = (id: string, facts: Partial<RunRow> = {}): RunRow => ({
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
  outages: [],
  run: "",
  asks: false,
  stamp: 1e9,
  mission: null,
  ...facts,
});
const ROWS = [
  row("a", { outcome: "aborted", reason: "DRIVE: goal lost", robots: ["robot_0"] }),
  row("b", { machine: "PATROL", strip: [[0, "DOCK", 0, 1, "success"]] }),
  row("c", { live: true, outcome: null, ended: null, robots: ["robot_0", "robot_1"] }),
  row("d", { outcome: null, ended: null }),
  row("e", { outcome: "preempted", began: 2e9, stamp: 2e9 }),
];
const ALL = { show: "all", machine: null, robot: null, text: "" };
const ids = (filter: object, pins = new Set<string>()) =>
  chosen(ROWS, { ...ALL, ...filter }, pins)
    .map(({ id }) => id)
    .join("");

test("a run stands as its outcome, live, or without an end", () => {
  assert.deepEqual(ROWS.map(standing), ["failure", "success", "live", "cut", "preempted"]);
});

test("live runs come first, then pinned ones, then as they came", () => {
  assert.equal(ids({}), "cabde");
  assert.equal(ids({}, new Set([pinOf(ROWS[4])])), "ceabd");
});

test("filters choose together", () => {
  assert.equal(ids({ show: "failure" }), "a");
  assert.equal(ids({ show: "pinned" }, new Set([pinOf(ROWS[1]), "gone"])), "b");
  assert.equal(ids({ robot: "robot_0" }), "ca");
  assert.equal(ids({ machine: "PATROL", show: "failure" }), "");
  assert.equal(ids({ text: "GOAL drive" }), "a");
  assert.equal(ids({ text: "dock" }), "b");
  assert.equal(ids({ text: "  " }), "cabde");
  assert.equal(filterText({ ...ALL, show: "failure", machine: "PATROL" }), "failed and of PATROL");
});

test("runs are counted by what they can be chosen by", () => {
  const counts = countsOf(ROWS, new Set([pinOf(ROWS[1])]));
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
    [2, 2, 10, 2, 1],
  );
  assert.equal(secondsOf(row("x", { began: null }), 0), null);
});

test("today has hours, other days are dates", () => {
  const today = new Date(2026, 4, 1, 12, 0);
  assert.equal(beganText(today.getTime() * 1e6, today), "12:00");
  assert.equal(beganText(new Date(2026, 3, 1).getTime() * 1e6, today), "1 Apr 2026");
});

const mission = (status: Mission["status"]): Mission => ({
  id: "m",
  journal: "j.db",
  status,
  active: [],
  problem: "",
  can: [],
});

test("durable missions stand as their journals say, and are found", () => {
  const open = { outcome: null, ended: null };
  const rows = [
    row("f", { ...open, mission: mission("interrupted"), run: "f 1", outages: [[1, 2]] }),
    row("g", { ...open, mission: mission("queued"), run: "g 1" }),
    row("h", { ...open, mission: mission("running"), run: "h 1" }),
    row("i", { outcome: "done", mission: mission("ended"), run: "i 1" }),
  ];
  assert.deepEqual(rows.map(standing), ["interrupted", "queued", "live", "success"]);
  const found = (show: string) => chosen([...ROWS, ...rows], { ...ALL, show }, new Set()).length;
  assert.deepEqual(["durable", "interrupted", "asking"].map(found), [4, 1, 0]);
  assert.equal(pinOf(rows[0]), "f 1");
  assert.equal(secondsOf(rows[2], 11_000), 10);
});

test("outages in words", () => {
  const text = (...outages: [number, number][]) => outageText(row("x", { outages }));
  assert.deepEqual(
    [text(), text([1, 4]), text([1, 4], [5, 200])],
    ["", "resumed after 3.0 s", "resumed after 2 outages, 3 min 18"],
  );
});
