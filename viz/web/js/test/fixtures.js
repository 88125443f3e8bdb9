// Data that Python's tests share (tests/viz/live/test_page_fixtures.py).
import { readFileSync } from "node:fs";

/** @param {string} name @returns {any} */
export const fixture = (name) =>
  JSON.parse(readFileSync(new URL(`../../../../tests/data/${name}`, import.meta.url), "utf-8"));

let seq = 0;
/** An event, a second after the one before. @param {string} kind @param {string} path @param {object} [facts] */
export function event(kind, path, facts = {}) {
  seq += 1;
  return { kind, path, seq, stamp_ns: seq * 1e9, ...facts };
}

/** Seconds that were added up differ in the last digits. @param {any} state */
export const rounded = (state) =>
  JSON.parse(JSON.stringify(state), (key, value) => (key === "seconds" ? Number(value.toFixed(6)) : value));
