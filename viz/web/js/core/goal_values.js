// The values of a goal's form: converts between the server's description of fields (viz/live/forms.py), a tree of
// texts, and YAML for the server. Only the server decides whether a value is valid.
// tests/data/forms.json has examples that are tested on both sides.

const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;
/** @type {Record<string, string>} */
const SPECIAL = {
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

/** Whether an array is edited as one text with commas. @param {FormField} field */
export const isOneText = (field) => Boolean(field.array) && !["string", "message"].includes(field.kind);

/**
 * @param {FormField[]} fields
 * @param {Record<string, any>} values as the server sends them
 * @returns {Record<string, any>}
 */
export function toState(fields, values) {
  return Object.fromEntries(fields.map((field) => [field.name, stateOf(field, values[field.name])]));
}

/** @param {FormField} field @param {any} value */
function stateOf(field, value) {
  if (isOneText(field)) return value.join(", ");
  const one = (/** @type {any} */ item) => (field.kind === "message" ? toState(field.fields, item) : item);
  return field.array ? value.map(one) : one(value);
}

/**
 * @param {FormField[]} fields
 * @param {Record<string, any>} state
 * @returns {string}
 */
export function toYaml(fields, state) {
  return `{${fields.map((field) => `${field.name}: ${yamlOf(field, state[field.name])}`).join(", ")}}`;
}

/** @param {FormField} field @param {any} value */
function yamlOf(field, value) {
  if (isOneText(field))
    return `[${items(value)
      .map((text) => scalar(field.kind, text))
      .join(", ")}]`;
  const one = (/** @type {any} */ item) =>
    field.kind === "message" ? toYaml(field.fields, item) : scalar(field.kind, item);
  return field.array ? `[${value.map(one).join(", ")}]` : one(value);
}

/** @param {string} text */
function items(text) {
  const inner = text
    .trim()
    .replace(/^\[|\]$/g, "")
    .trim();
  return inner ? inner.split(/\s*,\s*|\s+/) : [];
}

/** @param {string} kind @param {any} value */
function scalar(kind, value) {
  if (kind === "string") return quoted(value);
  const text = String(value).trim();
  if (kind === "bool") return ["true", "false"].includes(text) ? text : quoted(value);
  if (kind === "time") return text === "now" ? "now" : NUMBER.test(text) ? time(text) : quoted(text);
  // BigInt, because a Number would round 64-bit integers.
  if (kind === "integer" && /^[-+]?\d+$/.test(text)) return BigInt(text.replace("+", "")).toString();
  if (kind === "float" && Object.hasOwn(SPECIAL, text.toLowerCase())) return SPECIAL[text.toLowerCase()];
  return NUMBER.test(text) && Number.isFinite(Number(text)) ? decimal(text) : quoted(text);
}

/** A number with a decimal point, without which YAML reads an integer or a string. @param {string} text */
function decimal(text) {
  const short = String(Number(text));
  if (short.includes(".")) return short;
  return short.includes("e") ? short.replace("e", ".0e") : `${short}.0`;
}

/** Seconds and nanoseconds, exactly: a Number would round times since the epoch. @param {string} text */
function time(text) {
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

/** @param {unknown} text */
const quoted = (text) =>
  JSON.stringify(String(text)).replace(UNPRINTABLE, (c) => `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`);

/**
 * The problem of a field, or of an item in an array that is one text.
 * @param {FieldProblem[]} problems
 * @param {string} path
 * @param {FormField} [field]
 */
export function problemOf(problems, path, field) {
  const its = problems.find((one) => one.path === path);
  if (its) return its.text;
  const item = field && isOneText(field) && problems.find((one) => one.path.startsWith(`${path}[`));
  return item ? `item ${Number(item.path.slice(path.length + 1, -1)) + 1}: ${item.text}` : null;
}

/**
 * The problems that no field of the form shows.
 * @param {FieldProblem[]} problems
 * @param {FormField[]} fields
 * @param {Record<string, any>} state
 */
export function problemsWithoutField(problems, fields, state) {
  /** @type {Set<string>} */
  const shown = new Set();
  /** @type {string[]} */
  const texts = []; // arrays that are one text show the problems of their items
  const visit = (
    /** @type {FormField[]} */ some,
    /** @type {Record<string, any>} */ values,
    /** @type {string} */ path,
  ) => {
    for (const field of some) {
      const at = `${path}.${field.name}`;
      shown.add(at);
      if (isOneText(field)) texts.push(`${at}[`);
      else if (field.array)
        for (const [i, item] of values[field.name].entries()) {
          shown.add(`${at}[${i}]`);
          if (field.kind === "message") visit(field.fields, item, `${at}[${i}]`);
        }
      else if (field.kind === "message") visit(field.fields, values[field.name], at);
    }
  };
  visit(fields, state, "$");
  return problems.filter(({ path }) => !shown.has(path) && !texts.some((start) => path.startsWith(start)));
}

/**
 * The text of a problem, with the value in place of the type that the server got.
 * @param {string} text
 * @param {unknown} value
 */
export function problemText(text, value) {
  if (!text.endsWith("got str")) return text;
  const all = [...String(value)];
  const short = all.length > 40 ? `${all.slice(0, 40).join("")}\u2026` : String(value);
  return text.replace(/got str$/, () => (String(value).trim() ? `got \u201c${short}\u201d` : "got nothing"));
}
