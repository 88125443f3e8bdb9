// Parses the output of Python's repr() into a tree: values of a mission's own classes are sent in this form.

/**
 * @typedef {{ name: string, items: [string | null, Tree][], end: string }} Branch such as Pose(x=1.0, y=2.0); of a
 *   list, a tuple or a dict `name` is the bracket
 * @typedef {string | Branch} Tree
 */

/** @type {Record<string, string>} */
const ENDS = { "(": ")", "[": "]", "{": "}" };
const MOST_DEPTH = 20;
const WORD = /[^\s,()[\]{}=:'"]+/uy;
const TEXT = /[bru]?('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")/uy;
const LONG_FRACTION = /(?<![\w.])-?\d+\.\d{5,}(?:e[+-]?\d+)?(?![\w.])/gi;

/** A text with its numbers rounded: 1.570800000000002 becomes 1.5708. @param {string} text */
export const rounded = (text) => text.replace(LONG_FRACTION, (number) => String(Number(Number(number).toPrecision(5))));

/**
 * The tree of a text; null if it is not a complete repr with parts, but cut off or a sentence, for example.
 * @param {string} text
 * @returns {Branch | null}
 */
export function parseRepr(text) {
  let at = 0;
  const skip = () => {
    while (/\s/.test(text[at] ?? "")) at += 1;
  };
  /** @param {RegExp} pattern @returns {string | null} */
  const take = (pattern) => {
    pattern.lastIndex = at;
    const found = pattern.exec(text);
    if (!found) return null;
    at += found[0].length;
    return found[0];
  };
  /** @param {number} depth @returns {Tree | null} */
  const value = (depth) => {
    skip();
    const word = take(TEXT) ?? take(WORD) ?? "";
    const end = ENDS[text[at] ?? ""];
    if (end === undefined || depth > MOST_DEPTH) return word || null;
    if (word && text[at] !== "(") return null;
    const name = word || text[at];
    at += 1;
    /** @type {[string | null, Tree][]} */
    const items = [];
    for (skip(); text[at] !== end; skip()) {
      const first = value(depth + 1);
      if (first === null) return null;
      skip();
      const isNamed = text[at] === "=" || text[at] === ":";
      if (isNamed) at += 1;
      const second = isNamed ? value(depth + 1) : null;
      if (isNamed && (second === null || typeof first !== "string")) return null;
      items.push(isNamed ? [/** @type {string} */ (first), /** @type {Tree} */ (second)] : [null, first]);
      skip();
      if (text[at] === ",") at += 1;
      else if (text[at] !== end) return null;
    }
    at += 1;
    return { name, items, end };
  };
  const tree = value(0);
  skip();
  return at === text.length && tree !== null && typeof tree !== "string" && tree.items.length ? tree : null;
}
