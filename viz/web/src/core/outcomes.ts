// The class of an outcome, by its name. The same table as in smachpy/events/outcome_classes.py;
// tests/data/outcome_classes.json has examples for both.

import type { OutcomeClass, StateNode } from "#core/types.ts";

const words = (text: string) => text.split(" ");

export const SUCCESS = words(
  "succeeded success successful done ok yes true valid complete completed finished reached arrived goal",
);
export const FAILURE = words(
  "abort aborted fail failed failure error exception invalid no false timeout timed_out lost rejected denied" +
    " impossible unreachable unreached",
);
export const PREEMPTED_PREFIXES = words("preempt cancel recall interrupt");

const known: Map<unknown, OutcomeClass> = new Map(); // a cache, as the class is needed at every event
const MOST_KNOWN = 2000;

/** The class of an outcome by its name; a state may say more, see `endClass`. */
export function outcomeClass(outcome: unknown): OutcomeClass {
  const before = known.get(outcome);
  if (before) return before;
  const found = classOf(outcome);
  if (known.size < MOST_KNOWN) known.set(outcome, found);
  return found;
}

function classOf(outcome: unknown): OutcomeClass {
  const word = String(outcome).toLowerCase().replace(/[- ]/g, "_");
  if (SUCCESS.includes(word)) return "success";
  if (FAILURE.includes(word)) return "failure";
  return PREEMPTED_PREFIXES.some((start) => word.startsWith(start)) ? "preempted" : "other";
}

const WATCHING = ["monitor", "condition"];
const FINDINGS = ["invalid", "false", "no"];

/**
 * The class of a state's end: what the state says. Else the outcome of a monitor or condition, even "invalid",
 * is not a failure.
 * @param outcome its outcome; "exception" if it raised one
 */
export function endClass(node: StateNode | null | undefined, outcome: string | null) {
  if (node?.success) {
    if (node.success.includes(String(outcome))) return "success";
    return outcomeClass(outcome) === "preempted" ? "preempted" : "failure";
  }
  const isFinding = node && WATCHING.includes(node.kind) && FINDINGS.includes(String(outcome).toLowerCase());
  return isFinding ? "other" : outcomeClass(outcome);
}

/** The common class of several outcomes of a state; "other" if they differ. */
export function commonClass(node: StateNode | null | undefined, outcomes: string[]): OutcomeClass {
  const classes = new Set(outcomes.map((outcome) => endClass(node, outcome)));
  const [first] = classes;
  return classes.size === 1 ? first : "other";
}
