// Texts for people: shortened lines, durations, origins of preempts.
// The same rules as in viz/smachpy_viz/model/labels.py and smachpy/events; tests/data/texts.json has examples for both.

import { own } from "#core/fold.ts";
import type { PreemptedSpan, PreemptRequest } from "#core/types.ts";

// White space as in Python's str.split(), and characters for which Python's str.isprintable() is false.
const SPACE = /[\t-\r\u0085\p{Z}]+/u;
const UNPRINTABLE = /[\p{C}\p{Z}]/gu;

/** One line of at most `length` printable characters. */
export function shorten(text: unknown, length = 34) {
  // Cut first, as texts can have megabytes, and by characters: a UTF-16 pair must not be divided.
  const start = [...String(text).slice(0, 8 * length)].slice(0, 4 * length).join("");
  const words = start.split(SPACE).filter(Boolean);
  const line = [...words.map((word) => word.replace(UNPRINTABLE, "\ufffd")).join(" ")];
  return line.length <= length ? line.join("") : `${line.slice(0, length - 1).join("")}\u2026`;
}

/** The same with the line breaks of the text; all lines together have at most about `length` characters. */
export function shortenLines(text: string, length: number) {
  const lines = [];
  let left = length;
  for (const line of text.trim().split(/\r?\n/)) {
    if (left <= 0) return [...lines, "\u2026"].join("\n");
    lines.push(shorten(line, left));
    left -= line.length + 1;
  }
  return lines.join("\n");
}

export function duration(seconds: number) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  const two = (n: number) => String(Math.floor(n)).padStart(2, "0");
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min ${two(seconds % 60)}`;
  return `${Math.floor(seconds / 3600)} h ${two((seconds % 3600) / 60)}`;
}

export const countOfEvents = (count: number) => `${count.toLocaleString("en")} event${count === 1 ? "" : "s"}`;

const SOURCES: Record<string, string> = {
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

/** The origin of a preempt as a phrase; null if it is unknown, as in older recordings. */
export function askerText(asked: Partial<PreemptRequest> | null | undefined) {
  if (!asked?.source) return null;
  const who = `${own(SOURCES, asked.source) ?? asked.source} ${asked.by ?? ""}`.trim();
  return asked.why ? `${who}: ${asked.why}` : who;
}

/** How long a preempt has waited for a state at the instant `now` [ms]. */
export function holdText(row: PreemptedSpan, now: number) {
  const grace = row.asked?.grace;
  const limit = grace != null ? ` of ${duration(grace)}` : "";
  return `${duration((now - row.preempt) / 1000)}${limit}${row.serviced !== null ? ", cleaning up" : ""}`;
}

/** The end of a path that tells it from the others: its last part, with more of it if others end so. */
export function endOfPath(path: string, paths: string[]) {
  const parts = path.split("/");
  const ends = (one: string, end: string) => `/${one}`.endsWith(`/${end}`);
  for (let count = 1; count < parts.length; count++) {
    const end = parts.slice(-count).join("/");
    if (end && paths.filter((one) => ends(one, end)).length < 2) return end;
  }
  return path;
}

/** The last part of a path. */
export const lastWord = (path: string) => path.split("/").at(-1) || path;
