// The class of an outcome, by its name. The same table as in smachpy/outcome_classes.py;
// tests/data/outcome_classes.json has examples for both.

const words = (/** @type {string} */ text) => text.split(" ");

export const SUCCESS = words(
  "succeeded success successful done ok yes true valid complete completed finished reached arrived",
);
export const FAILURE = words(
  "abort aborted fail failed failure error exception invalid no false timeout timed_out lost rejected denied" +
    " impossible unreachable unreached",
);
export const PREEMPTED_PREFIXES = words("preempt cancel recall interrupt");

/** @type {Map<unknown, OutcomeClass>} */
const known = new Map(); // a cache, as the class is needed at every event
const MOST_KNOWN = 2000;

/**
 * @param {unknown} outcome
 * @returns {OutcomeClass}
 */
export function outcomeClass(outcome) {
  const before = known.get(outcome);
  if (before) return before;
  const found = classOf(outcome);
  if (known.size < MOST_KNOWN) known.set(outcome, found);
  return found;
}

/** @param {unknown} outcome @returns {OutcomeClass} */
function classOf(outcome) {
  const word = String(outcome).toLowerCase().replace(/[- ]/g, "_");
  if (SUCCESS.includes(word)) return "success";
  if (FAILURE.includes(word)) return "failure";
  return PREEMPTED_PREFIXES.some((start) => word.startsWith(start)) ? "preempted" : "other";
}

const WATCHING = ["monitor", "condition"];
const FINDINGS = ["invalid", "false", "no"];

/**
 * The class of a state's end; the outcome of a monitor or condition, even "invalid", is not a failure.
 * @param {StateNode | null | undefined} node
 * @param {string | null} outcome its outcome; "exception" if it raised one
 */
export function endClass(node, outcome) {
  const isFinding = node && WATCHING.includes(node.kind) && FINDINGS.includes(String(outcome).toLowerCase());
  return isFinding ? "other" : outcomeClass(outcome);
}

/**
 * The common class of several outcomes of a state; "other" if they differ.
 * @param {StateNode | null | undefined} node
 * @param {string[]} outcomes
 * @returns {OutcomeClass}
 */
export function commonClass(node, outcomes) {
  const classes = new Set(outcomes.map((outcome) => endClass(node, outcome)));
  const [first] = classes;
  return classes.size === 1 ? first : "other";
}
