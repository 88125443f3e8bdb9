// Values of userdata and fields of messages as text.

import { rounded } from "#core/repr.js";

const MOST = 20_000; // characters that are shown

/** A message without its type. @param {string} _key @param {any} value */
const withoutType = (_key, value) => (value?.$msg ? value.fields : value);

/** On several lines. @param {unknown} value */
export const pretty = (value) =>
  (JSON.stringify(value, withoutType, 1) ?? "").replace(/^(\s*)"([a-z_0-9]+)":/gim, "$1$2:").slice(0, MOST);

/** On one line. @param {any} value */
export function brief(value) {
  if (typeof value === "string") return rounded(value);
  const plain = value?.$msg ? { [value.$msg]: value.fields } : value;
  const shortened = (/** @type {string} */ key, /** @type {any} */ one) =>
    typeof one === "number" && !Number.isInteger(one) ? Number(one.toPrecision(6)) : withoutType(key, one);
  return JSON.stringify(plain, shortened) ?? "";
}

/**
 * Whether a value was shortened before it was sent (`smachpy.events.to_record`).
 * @param {string} text as returned by `brief`
 */
export const wasShortened = (text) => /\u2026$|\u2026"|<\S+ of \d+ elements>/.test(text);
