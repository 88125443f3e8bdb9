// The values of a goal's form: converts between the server's description of fields
// (viz/smachpy_viz/live/forms.py), a tree of texts, and YAML for the server. Only the server decides
// whether a value is valid. tests/data/forms.json has examples that are tested on both sides.

import type { FieldProblem, FormField, Json } from "#core/types.ts";

const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;
const SPECIAL: Record<string, string> = {
  nan: ".nan",
  ".nan": ".nan",
  inf: ".inf",
  "+inf": ".inf",
  ".inf": ".inf",
  infinity: ".inf",
  "-inf": "-.inf",
  "-.inf": "-.inf",
  "-infinity": "-.inf",
};
const UNPRINTABLE = /[\u007f-\u009f\u2028\u2029\ufeff\ufffe\uffff]/g;

/** Whether an array is edited as one text with commas. */
export const isOneText = (field: FormField) => Boolean(field.array) && !["string", "message"].includes(field.kind);

/** The state of a form: texts, by the names of the fields; lists and trees of them. */
export type FormState = { [name: string]: Json };

const textIn = (value: Json) => (Array.isArray(value) ? value.join(", ") : String(value));
export const listIn = (value: Json) => (Array.isArray(value) ? value : []);
export const treeIn = (value: Json): FormState =>
  typeof value === "object" && value !== null && !Array.isArray(value) ? value : {};

/** @param values as the server sends them */
export function toState(fields: FormField[], values: FormState): FormState {
  return Object.fromEntries(fields.map((field) => [field.name, stateOf(field, values[field.name])]));
}

function stateOf(field: FormField, value: Json): Json {
  if (isOneText(field)) return textIn(value);
  const one = (item: Json) => (field.kind === "message" ? toState(field.fields ?? [], treeIn(item)) : item);
  return field.array ? listIn(value).map(one) : one(value);
}

export function toYaml(fields: FormField[], state: FormState): string {
  return `{${fields.map((field) => `${field.name}: ${yamlOf(field, state[field.name])}`).join(", ")}}`;
}

function yamlOf(field: FormField, value: Json) {
  if (isOneText(field))
    return `[${items(textIn(value))
      .map((text) => scalar(field.kind, text))
      .join(", ")}]`;
  const one = (item: Json) =>
    field.kind === "message" ? toYaml(field.fields ?? [], treeIn(item)) : scalar(field.kind, item);
  return field.array ? `[${listIn(value).map(one).join(", ")}]` : one(value);
}

function items(text: string) {
  const inner = text
    .trim()
    .replace(/^\[|\]$/g, "")
    .trim();
  return inner ? inner.split(/\s*,\s*|\s+/) : [];
}

function scalar(kind: string, value: Json) {
  if (kind === "string") return quoted(value);
  const text = String(value).trim();
  if (kind === "bool") return ["true", "false"].includes(text) ? text : quoted(value);
  if (kind === "time") return text === "now" ? "now" : NUMBER.test(text) ? time(text) : quoted(text);
  // BigInt, because a Number would round 64-bit integers.
  if (kind === "integer" && /^[-+]?\d+$/.test(text)) return BigInt(text.replace("+", "")).toString();
  if (kind === "float" && Object.hasOwn(SPECIAL, text.toLowerCase())) return SPECIAL[text.toLowerCase()];
  return NUMBER.test(text) && Number.isFinite(Number(text)) ? decimal(text) : quoted(text);
}

/** A number with a decimal point, without which YAML reads an integer or a string. */
function decimal(text: string) {
  const short = String(Number(text));
  if (short.includes(".")) return short;
  return short.includes("e") ? short.replace("e", ".0e") : `${short}.0`;
}

/** Seconds and nanoseconds, exactly: a Number would round times since the epoch. */
function time(text: string) {
  if (/e/i.test(text)) return decimal(text);
  const [whole, part = ""] = text.replace(/^[-+]/, "").split(".");
  let total = BigInt(whole || "0") * 1_000_000_000n + BigInt(part.padEnd(9, "0").slice(0, 9));
  if (text.startsWith("-")) total = -total;
  let secs = total / 1_000_000_000n;
  let nsecs = total % 1_000_000_000n;
  if (nsecs < 0n) {
    secs -= 1n;
    nsecs += 1_000_000_000n;
  }
  return `{secs: ${secs}, nsecs: ${nsecs}}`;
}

const quoted = (text: unknown) =>
  JSON.stringify(String(text)).replace(UNPRINTABLE, (c) => `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`);

/** The problem of a field, or of an item in an array that is one text. */
export function problemOf(problems: FieldProblem[], path: string, field?: FormField) {
  const its = problems.find((one) => one.path === path);
  if (its) return its.text;
  const item = field && isOneText(field) && problems.find((one) => one.path.startsWith(`${path}[`));
  return item ? `item ${Number(item.path.slice(path.length + 1, -1)) + 1}: ${item.text}` : null;
}

/** The problems that no field of the form shows. */
export function problemsWithoutField(problems: FieldProblem[], fields: FormField[], state: FormState) {
  const shown: Set<string> = new Set();
  const texts: string[] = []; // arrays that are one text show the problems of their items
  const visit = (some: FormField[], values: FormState, path: string) => {
    for (const field of some) {
      const at = `${path}.${field.name}`;
      shown.add(at);
      if (isOneText(field)) texts.push(`${at}[`);
      else if (field.array)
        for (const [i, item] of listIn(values[field.name]).entries()) {
          shown.add(`${at}[${i}]`);
          if (field.kind === "message") visit(field.fields ?? [], treeIn(item), `${at}[${i}]`);
        }
      else if (field.kind === "message") visit(field.fields ?? [], treeIn(values[field.name]), at);
    }
  };
  visit(fields, state, "$");
  return problems.filter(({ path }) => !shown.has(path) && !texts.some((start) => path.startsWith(start)));
}

/** The text of a problem, with the value in place of the type that the server got. */
export function problemText(text: string, value: unknown) {
  if (!text.endsWith("got str")) return text;
  const all = [...String(value)];
  const short = all.length > 40 ? `${all.slice(0, 40).join("")}\u2026` : String(value);
  return text.replace(/got str$/, () => (String(value).trim() ? `got \u201c${short}\u201d` : "got nothing"));
}
