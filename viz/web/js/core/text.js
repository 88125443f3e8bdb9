// Texts for people: one line of anything, spans of time, who asked for a preempt.
// The same rules as viz/model/labels.py and smachpy/events: tests/data/texts.json holds for both.

import { own } from "#core/fold.js";

// What Python's str.split() takes for space, and str.isprintable() not for printable.
const SPACE = /[\t-\r\u0085\p{Z}]+/u;
const UNPRINTABLE = /[\p{C}\p{Z}]/gu;

/**
 * One line of at most `length` printable characters, whatever `text` holds.
 * @param {unknown} text
 */
export function shorten(text, length = 34) {
  const start = [...String(text).slice(0, 8 * length)].slice(0, 4 * length).join(""); // whole characters
  const words = start.split(SPACE).filter(Boolean);
  const line = [...words.map((word) => word.replace(UNPRINTABLE, "\ufffd")).join(" ")];
  return line.length <= length ? line.join("") : `${line.slice(0, length - 1).join("")}\u2026`;
}

/** @param {number} seconds */
export function duration(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  const two = (/** @type {number} */ n) => String(Math.floor(n)).padStart(2, "0");
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min ${two(seconds % 60)}`;
  return `${Math.floor(seconds / 3600)} h ${two((seconds % 3600) / 60)}`;
}

/** @param {number} count */
export const countOfEvents = (count) => `${count.toLocaleString("en")} event${count === 1 ? "" : "s"}`;

/** @type {Record<string, string>} */
const SOURCES = {
  signal: "signal",
  shutdown: "the program's end",
  operator: "operator",
  timeout: "timeout of",
  concurrence: "concurrence, after",
  plan: "plan",
  action: "action",
  state: "state",
  test: "test",
  program: "program",
};

/**
 * Who asked for a preempt, in one phrase; null when an older recording does not say.
 * @param {Partial<PreemptRequest> | null | undefined} asked
 */
export function askerText(asked) {
  if (!asked?.source) return null;
  const who = `${own(SOURCES, asked.source) ?? asked.source} ${asked.by ?? ""}`.trim();
  return asked.why ? `${who}: ${asked.why}` : who;
}

/**
 * How long a state has held a preempt up at the instant `now` [ms].
 * @param {PreemptedSpan} row
 * @param {number} now
 */
export function holdText(row, now) {
  const grace = row.asked?.grace;
  const limit = grace != null ? ` of ${duration(grace)}` : "";
  return `${duration((now - row.preempt) / 1000)}${limit}${row.serviced !== null ? ", cleaning up" : ""}`;
}
