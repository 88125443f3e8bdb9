// The lines of the log: a text and a colour for each event.

import { RAISED, requestOf, resourceText } from "#core/fold.ts";
import { endClass, outcomeClass } from "#core/outcomes.ts";
import { purposeOf } from "#core/purposes.ts";
import { askerText, duration } from "#core/text.ts";
import type { EventKind, EventOf, RunEvent, StateNode } from "#core/types.ts";
import { brief } from "#core/values.ts";

type Lines = { [K in EventKind]?: (e: EventOf<K>) => [string, string] };

const LINES: Lines = {
  Started: () => ["started", "active"],
  Recovered: (e) => [`resumed after an outage of ${outageText(e)}`, "waiting"],
  Finished: (e) => [`ended: ${e.outcome || RAISED}`, outcomeClass(e.outcome || RAISED)],
  Left: (e) => [e.outcome, outcomeClass(e.outcome)],
  Failed: (e) => [e.error, "failure"],
  PreemptRequested: (e) => [requestText(e), "preempted"],
  PreemptServiced: () => ["preempt serviced", "preempted"],
  Abandoned: (e) => [`abandoned after ${e.grace} s`, "failure"],
  TimedOut: (e) => [`timeout of ${e.timeout} s`, "preempted"],
  Retried: (e) => [`retry: ${e.reason}`, "preempted"],
  Iterated: (e) => [`item ${e.number + 1}`, "other"],
  ResourceUse: (e) => [resourceText(e), e.status === "holds" || e.status === "free" ? "other" : "waiting"],
  Noted: (e) => [e.text, "other"],
  CallbackFailed: (e) => [`${e.callback}: ${e.error}`, "failure"],
  Paused: (e) => [`paused (${e.reason})`, "waiting"],
  Resumed: () => ["resumed", "active"],
  Jumped: (e) => [`jump to ${e.label}`, "waiting"],
  Fired: (e) => [`${e.transition} fired`, "other"],
  HeldBack: (e) => [`waits: ${heldText(e)}`, "waiting"],
  QuestionAsked: (e) => [`asks ${e.text}`.trim(), "waiting"],
  QuestionAnswered: (e) => [e.by ? `answered ${e.answer} by ${e.by}` : `nobody answered: ${e.answer}`, "waiting"],
  OutcomeForced: (e) => [`forced: ${e.outcome}`, "waiting"],
  GoalSent: (e) => [goalText(e), "active"],
  GoalDone: (e) => [`${e.action}: ${e.status.toLowerCase()} ${e.text}`.trim(), outcomeClass(e.status)],
  UserdataWritten: (e) => [`${e.key} = ${brief(e.value).slice(0, 60)}`, "other"],
};

function outageText({ outages }: EventOf<"Recovered">) {
  const [from, to] = outages?.at(-1) ?? [0, 0];
  return duration((to - from) / 1e9);
}

function goalText(e: EventOf<"GoalSent">) {
  const purpose = purposeOf(e.goal_id, e);
  return `goal to ${e.action}${purpose && ` \u2192 ${purpose}`}`;
}

function heldText({ guards, truths }: EventOf<"HeldBack">) {
  const text = (guard: string, i: number) => `[${guard}] is false${truths?.[i] ? ` (${truths[i]})` : ""}`;
  return guards.map(text).join(", ");
}

function requestText(e: EventOf<"PreemptRequested">) {
  const asker = askerText(requestOf(e));
  return `asked to stop${asker ? ` by ${asker}` : ""}${e.grace != null ? `, within ${duration(e.grace)}` : ""}`;
}

/**
 * The text of an event's line, and the class of its colour.
 * @param e of one of `KINDS_OF`
 * @param node of its path
 */
export function lineOf(e: RunEvent, node?: StateNode | null) {
  const line = LINES[e.kind] as ((e: RunEvent) => [string, string]) | undefined;
  const [text, kind] = line?.(e) ?? [e.kind, "other"];
  if (e.kind === "Fired") {
    const name = node?.children.find(({ label }) => label === e.transition)?.name;
    return { text: name ? `${name} fired` : text, kind };
  }
  return { text, kind: e.kind === "Left" ? endClass(node, e.outcome) : kind };
}

/** Kinds of events by the name of a filter. */
export const KINDS_OF: Record<string, Set<string>> = {
  all: new Set(Object.keys(LINES).filter((kind) => kind !== "UserdataWritten")),
  transitions: new Set(["Started", "Recovered", "Finished", "Left", "Failed"]),
  goals: new Set(["GoalSent", "GoalDone"]),
  userdata: new Set(["UserdataWritten"]),
  trouble: new Set([
    "Failed",
    "PreemptRequested",
    "PreemptServiced",
    "Abandoned",
    "TimedOut",
    "Retried",
    "CallbackFailed",
  ]),
};
