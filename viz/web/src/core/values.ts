// Values of userdata and messages: their parts, and their text as Python writes it.
// The forms of smachpy/userdata/shown.py; tests/data/values.json has examples for both.

const MOST = 20_000; // characters that are shown
const ROUNDED = 6; // digits of a number in a short text
const WIDE = 88; // columns of a value on several lines
const QUOTED = /[\\\p{Cc}\u00a0\u2028\u2029]/gu;
const ESCAPES: Record<string, string> = { "\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t" };

/** A text in Python's quotes. */
function quoted(text: string) {
  const quote = text.includes("'") && !text.includes('"') ? '"' : "'";
  const hex = (c: string) => c.charCodeAt(0).toString(16);
  const inside = text.replace(QUOTED, (c) => {
    const long = c.charCodeAt(0) > 255;
    return ESCAPES[c] ?? (long ? `\\u${hex(c)}` : `\\x${hex(c).padStart(2, "0")}`);
  });
  return `${quote}${quote === "'" ? inside.replaceAll("'", "\\'") : inside}${quote}`;
}

/** An object of JSON. */
export type Tree = { [key: string]: unknown };

export const isTree = (value: unknown): value is Tree =>
  typeof value === "object" && value !== null && !Array.isArray(value);

const items = (value: unknown): unknown[] => {
  if (!Array.isArray(value)) throw new TypeError("no list"); // a damaged recording
  return value;
};

/** The name of a message's or object's class. */
const className = (value: Tree) => String(value.$object ?? String(value.$msg).split("/").at(-1));

/** The fields of a message, an object or a dict with texts as keys; null for others. */
export function fieldsOf(value: unknown): Tree | null {
  if (!isTree(value)) return null;
  if ("$msg" in value || "$object" in value) return isTree(value.fields) ? value.fields : {};
  return formOf(value) === null ? value : null;
}

export type Branch = { name: string; begin: string; end: string; sign: string; parts: [string | null, unknown][] };

const FORMS: Record<string, (value: Tree) => Branch | string> = {
  $tuple: ({ $tuple }) => listed("tuple", "(", items($tuple), items($tuple).length === 1 ? ",)" : ")"),
  $set: ({ $set }) => (items($set).length ? listed("set", "{", items($set), "}") : "set()"),
  $items: ({ $items }) => ({
    ...{ name: "dict", begin: "{", end: "}", sign: ": " },
    parts: items($items).map((item) => [brief(items(item)[0]), items(item)[1]]),
  }),
  $float: ({ $float }) => String($float),
  $int: ({ $int }) => String($int),
  $bytes: ({ $bytes }) => `b${quoted(atob(String($bytes)))}`,
  $msg: (value) => called(value),
  $object: (value) => called(value),
  $array: ({ $array, dtype }) => listed("array", "array([", items($array), `], dtype=${dtype})`),
  $cut: ({ $cut }) => `${quoted(String($cut))}\u2026`,
  $large: ({ $large, length }) => `<${$large} of ${length} elements>`,
  $repr: ({ $repr }) => String($repr),
};

const listed = (name: string, begin: string, parts: unknown[], end: string): Branch => ({
  name,
  begin,
  end,
  sign: "",
  parts: parts.map((one) => [null, one]),
});

const called = (value: Tree): Branch => ({
  ...{ name: className(value), begin: `${className(value)}(`, end: ")", sign: "=" },
  parts: Object.entries(fieldsOf(value) ?? {}),
});

/** The form of an object that JSON alone does not have; null for a dict. */
const formOf = (value: object) => Object.keys(FORMS).find((mark) => Object.hasOwn(value, mark)) ?? null;

/** The parts of a value, or its text if it has none. */
function opened(value: unknown, numberText: (number: number) => string): Branch | string {
  if (value === null || value === undefined) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (typeof value === "number") return numberText(value);
  if (typeof value === "string") return quoted(value);
  if (Array.isArray(value)) return listed("list", "[", value, "]");
  if (!isTree(value)) return String(value);
  const form = formOf(value);
  try {
    if (form) return FORMS[form](value);
  } catch {
    // a damaged recording: as it is
  }
  const parts = Object.entries(value).map(([key, part]): [string, unknown] => [quoted(key), part]);
  return { name: "dict", begin: "{", end: "}", sign: ": ", parts };
}

const rounded = (number: number) => String(Number.isInteger(number) ? number : Number(number.toPrecision(ROUNDED)));

/** The parts of a value with their names, or its text with rounded numbers. */
export const branchOf = (value: unknown) => opened(value, rounded);

/** On one line, as Python writes it, with rounded numbers. */
export const brief = (value: unknown): string => text(value, rounded);

function text(value: unknown, numberText: (number: number) => string): string {
  const one = opened(value, numberText);
  if (typeof one === "string") return one;
  const parts = one.parts.map(([name, part]) => `${head(one, name)}${text(part, numberText)}`);
  return `${one.begin}${parts.join(", ")}${one.end}`;
}

const head = ({ sign }: Branch, name: string | null) => (name === null ? "" : `${name}${sign}`);

/** On several lines, if it is long. */
export const pretty = (value: unknown) => wrapped(value, "").slice(0, MOST);

function wrapped(value: unknown, indent: string): string {
  const line = text(value, String);
  const one = opened(value, String);
  if (typeof one === "string" || line.length + indent.length <= WIDE) return line;
  const inner = `${indent}  `;
  const parts = one.parts.map(([name, part]) => `${inner}${head(one, name)}${wrapped(part, inner)}`);
  return `${one.begin}\n${parts.join(",\n")}\n${indent}${one.end}`;
}

/** Whether a part of a value was left out before it was sent. */
export function wasShortened(value: unknown): boolean {
  if (Array.isArray(value)) return value.some(wasShortened);
  if (!isTree(value)) return false;
  if ("$cut" in value || "$large" in value || String(value.$repr ?? "").endsWith("\u2026")) return true;
  return Object.values(value).some(wasShortened);
}
