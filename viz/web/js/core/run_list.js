// The list of runs: which of them are asked for, in which order, and how many there are of each sort.
import { outcomeClass } from "#core/outcomes.js";

/** @typedef {{ show: string, machine: string | null, robot: string | null, text: string }} Filter */

export const SHOWN = ["all", "live", "pinned", "success", "failure", "preempted", "other", "cut"];
/** @type {Record<string, string>} */
export const SHOWN_NAMES = {
  all: "All runs",
  live: "Live",
  pinned: "Pinned",
  success: "succeeded",
  failure: "failed",
  preempted: "preempted",
  other: "other",
  cut: "without an end",
};

/** How a run stands: live, the class of its outcome, or cut. @param {RunRow} row */
export function standing(row) {
  if (row.live) return "live";
  return row.outcome === null ? "cut" : outcomeClass(row.outcome);
}

/** @param {RunRow} row @param {string} show @param {Set<string>} pins */
const isShown = (row, show, pins) => show === "all" || (show === "pinned" ? pins.has(row.id) : standing(row) === show);

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
  const rank = (/** @type {RunRow} */ row) => (row.live ? 0 : pins.has(row.id) ? 1 : 2);
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
  const end = row.ended ?? (row.live ? now * 1e6 : row.last);
  return end === null ? null : Math.max(0, (end - row.began) / 1e9);
}

/** When a run began, as people say it: today the hour, else the date. @param {number} ns @param {Date} today */
export function beganText(ns, today) {
  const date = new Date(ns / 1e6);
  if (date.toDateString() === today.toDateString())
    return date.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  return date.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" });
}
