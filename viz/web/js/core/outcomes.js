// The class of an outcome, by its name. The same table as in smachpy/outcome_classes.py:
// tests/data/outcome_classes.json holds for both.

const words = (/** @type {string} */ text) => text.split(" ");

export const SUCCESS = words(
  "succeeded success successful done ok yes true valid complete completed finished reached arrived",
);
export const FAILURE = words(
  "abort aborted fail failed failure error exception invalid no false timeout timed_out lost rejected denied" +
    " impossible unreachable unreached",
);
export const PREEMPTED_PREFIXES = words("preempt cancel recall interrupt");

/**
 * @param {unknown} outcome
 * @returns {OutcomeClass}
 */
export function outcomeClass(outcome) {
  const word = String(outcome).toLowerCase().replace(/[- ]/g, "_");
  if (SUCCESS.includes(word)) return "success";
  if (FAILURE.includes(word)) return "failure";
  return PREEMPTED_PREFIXES.some((start) => word.startsWith(start)) ? "preempted" : "other";
}

/**
 * The class that all of them share, else "other".
 * @param {string[]} outcomes
 * @returns {OutcomeClass}
 */
export function commonClass(outcomes) {
  const classes = new Set(outcomes.map(outcomeClass));
  const [first] = classes;
  return classes.size === 1 ? first : "other";
}
