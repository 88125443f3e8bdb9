// The list of runs: which of them are asked for, in which order, and how many there are of each sort.
import { outcomeClass } from "#core/outcomes.js";
import { duration } from "#core/text.js";

/** @typedef {{ show: string, machine: string | null, robot: string | null, text: string }} Filter */

export const SHOWN = [
  "all",
  "live",
  "asking",
  "pinned",
  "durable",
  "interrupted",
  "queued",
  "success",
  "failure",
  "preempted",
  "other",
  "cut",
];
/** @type {Record<string, string>} */
export const SHOWN_NAMES = {
  all: "All runs",
  live: "Live",
  asking: "Asking a person",
  pinned: "Pinned",
  durable: "Durable",
  interrupted: "interrupted",
  queued: "queued",
  success: "succeeded",
  failure: "failed",
  preempted: "preempted",
  other: "other",
  cut: "without an end",
};

/** How a run stands: live, the class of its outcome, interrupted, queued, or cut. @param {RunRow} row */
export function standing(row) {
  const status = row.mission?.status ?? "";
  if (row.live || (status === "running" && row.outcome === null)) return "live";
  if (status === "interrupted" || status === "queued") return status;
  return row.outcome === null ? "cut" : outcomeClass(row.outcome);
}

/** What names a run however it is found: a live one keeps its pin when it is a file. @param {RunRow} row */
export const pinOf = (row) => row.run || (row.stamp === null ? row.id : `${row.machine} ${row.stamp}`);

/** @param {RunRow} row @param {string} show @param {Set<string>} pins */
function isShown(row, show, pins) {
  if (show === "all") return true;
  if (show === "pinned") return pins.has(pinOf(row));
  if (show === "durable") return row.run !== "" || row.mission !== null;
  if (show === "asking") return row.asks;
  return standing(row) === show;
}

/** @param {RunRow} row @param {string} text */
function hasText(row, text) {
  const all = [row.machine, ...row.robots, row.reason, row.outcome ?? "", ...row.strip.map((piece) => piece[1])];
  const inside = all.join(" ").toLowerCase();
  return text
    .toLowerCase()
    .split(/\s+/)
    .every((word) => inside.includes(word));
}

/**
 * The runs that are asked for: pinned ones first, then as they came.
 * @param {RunRow[]} rows @param {Filter} filter @param {Set<string>} pins
 */
export function chosen(rows, { show, machine, robot, text }, pins) {
  const found = rows.filter(
    (row) =>
      isShown(row, show, pins) &&
      (machine === null || row.machine === machine) &&
      (robot === null || row.robots.includes(robot)) &&
      hasText(row, text),
  );
  const rank = (/** @type {RunRow} */ row) => (row.live ? 0 : pins.has(pinOf(row)) ? 1 : 2);
  return found
    .map((row, i) => ({ row, i }))
    .sort((a, b) => rank(a.row) - rank(b.row) || a.i - b.i)
    .map(({ row }) => row);
}

/** How many runs each sort has. @param {RunRow[]} rows @param {Set<string>} pins */
export const countsOf = (rows, pins) =>
  new Map(SHOWN.map((show) => [show, rows.filter((row) => isShown(row, show, pins)).length]));

/**
 * Names and how many runs have them, most first.
 * @param {RunRow[]} rows
 * @param {(row: RunRow) => string[]} namesOf
 * @returns {[string, number][]}
 */
export function tally(rows, namesOf) {
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const row of rows) for (const name of namesOf(row)) counts.set(name, (counts.get(name) ?? 0) + 1);
  return [...counts].sort((a, b) => b[1] - a[1] || (a[0] < b[0] ? -1 : 1));
}

/** The filter in words, for one that finds nothing. @param {Filter} filter */
export function filterText({ show, machine, robot, text }) {
  const parts = [
    show === "all" ? "" : SHOWN_NAMES[show].toLowerCase(),
    machine === null ? "" : `of ${machine}`,
    robot === null ? "" : `with ${robot}`,
    text && `with “${text}”`,
  ];
  return parts.filter(Boolean).join(" and ");
}

/** How long a run took, or has been running [s]; null: nobody knows. @param {RunRow} row @param {number} now [ms] */
export function secondsOf(row, now) {
  if (row.began === null) return null;
  const runs = standing(row) === "live";
  const end = row.ended ?? (runs ? now * 1e6 : row.last);
  return end === null ? null : Math.max(0, (end - row.began) / 1e9);
}

/** When a run began, as people say it: today the hour, else the date. @param {number} ns @param {Date} today */
export function beganText(ns, today) {
  const date = new Date(ns / 1e6);
  if (date.toDateString() === today.toDateString())
    return date.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  return date.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" });
}

/** How long no process ran it, in words; "" when there was always one. @param {RunRow} row */
export function outageText({ outages }) {
  if (outages.length === 0) return "";
  const gone = outages.reduce((sum, [from, to]) => sum + to - from, 0);
  const times = outages.length > 1 ? `${outages.length} outages, ` : "";
  return `resumed after ${times}${duration(gone)}`;
}
