// The list of runs: filters, order and counts.

import { outcomeClass } from "#core/outcomes.ts";
import { duration } from "#core/text.ts";
import type { RunRow } from "#core/types.ts";

export type Filter = { show: string; machine: string | null; robot: string | null; text: string };

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
export const SHOWN_NAMES: Record<string, string> = {
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

/** The status of a run: live, interrupted, queued, cut (no end is known) or the class of its outcome. */
export function standing(row: RunRow) {
  const status = row.mission?.status ?? "";
  if (row.live || (status === "running" && row.outcome === null)) return "live";
  if (status === "interrupted" || status === "queued") return status;
  return row.outcome === null ? "cut" : outcomeClass(row.outcome);
}

/** A name by which a live run and its recording are the same: the run keeps its pin. */
export const pinOf = (row: RunRow) => row.run || (row.stamp === null ? row.id : `${row.machine} ${row.stamp}`);

function isShown(row: RunRow, show: string, pins: Set<string>) {
  if (show === "all") return true;
  if (show === "pinned") return pins.has(pinOf(row));
  if (show === "durable") return row.run !== "" || row.mission !== null;
  if (show === "asking") return row.asks;
  return standing(row) === show;
}

function hasText(row: RunRow, text: string) {
  const all = [row.machine, ...row.robots, row.reason, row.outcome ?? "", ...row.strip.map((piece) => piece[1])];
  const inside = all.join(" ").toLowerCase();
  return text
    .toLowerCase()
    .split(/\s+/)
    .every((word) => inside.includes(word));
}

/** The runs that match a filter: live ones first, then pinned ones, otherwise in the server's order. */
export function chosen(rows: RunRow[], { show, machine, robot, text }: Filter, pins: Set<string>) {
  const found = rows.filter(
    (row) =>
      isShown(row, show, pins) &&
      (machine === null || row.machine === machine) &&
      (robot === null || row.robots.includes(robot)) &&
      hasText(row, text),
  );
  const rank = (row: RunRow) => (row.live ? 0 : pins.has(pinOf(row)) ? 1 : 2);
  return found
    .map((row, i) => ({ row, i }))
    .sort((a, b) => rank(a.row) - rank(b.row) || a.i - b.i)
    .map(({ row }) => row);
}

/** The number of runs for each choice of `SHOWN`. */
export const countsOf = (rows: RunRow[], pins: Set<string>) =>
  new Map(SHOWN.map((show) => [show, rows.filter((row) => isShown(row, show, pins)).length]));

/** Names with the number of their runs, most frequent first. */
export function tally(rows: RunRow[], namesOf: (row: RunRow) => string[]): [string, number][] {
  const counts: Map<string, number> = new Map();
  for (const row of rows) for (const name of namesOf(row)) counts.set(name, (counts.get(name) ?? 0) + 1);
  return [...counts].sort((a, b) => b[1] - a[1] || (a[0] < b[0] ? -1 : 1));
}

/** The filter as text, for a list without matches. */
export function filterText({ show, machine, robot, text }: Filter) {
  const parts = [
    show === "all" ? "" : SHOWN_NAMES[show].toLowerCase(),
    machine === null ? "" : `of ${machine}`,
    robot === null ? "" : `with ${robot}`,
    text && `with “${text}”`,
  ];
  return parts.filter(Boolean).join(" and ");
}

/** The duration of a run so far [s]; null if it is unknown. @param now [ms] */
export function secondsOf(row: RunRow, now: number) {
  if (row.began === null) return null;
  const runs = standing(row) === "live";
  const end = row.ended ?? (runs ? now * 1e6 : row.last);
  return end === null ? null : Math.max(0, (end - row.began) / 1e9);
}

/** The beginning of a run: today the time, otherwise the date. */
export function beganText(ns: number, today: Date) {
  const date = new Date(ns / 1e6);
  if (date.toDateString() === today.toDateString())
    return date.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  return date.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" });
}

/** The outages of a mission as text; "" without any. */
export function outageText({ outages }: RunRow) {
  if (outages.length === 0) return "";
  const gone = outages.reduce((sum, [from, to]) => sum + to - from, 0);
  const times = outages.length > 1 ? `${outages.length} outages, ` : "";
  return `resumed after ${times}${duration(gone)}`;
}
