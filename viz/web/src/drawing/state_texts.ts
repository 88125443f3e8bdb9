// What the diagram says about a state, in signs and words.

import { ms } from "#core/fold.ts";
import { isInCleanup, isPartOfNet } from "#core/model.ts";
import { duration, shorten } from "#core/text.ts";
import type { GoalRun, OutcomeClass, StateNode, StateRun } from "#core/types.ts";

const BRIEF_MS = 400; // a state shows its clock after this time

export function glyphOf(state: StateRun | undefined, kind: OutcomeClass | null) {
  if (state?.waits) return "\u23f8";
  if (state?.since != null) return state.preempt ? (state.serviced ? "\u2713" : "\u25a0") : "";
  if (!kind) return "";
  if (state?.error) return "\u26a0";
  return { success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "" }[kind];
}

export function statusOf(state: StateRun | undefined, goal: GoalRun | null | undefined, noServer: boolean) {
  if (state?.since == null) return state?.outcome ?? "not visited";
  if (state.preempt) return `asked to stop${state.serviced ? ", cleaning up" : ""}`;
  return noServer && goal ? `no server of ${goal.action} seen` : (state.resource ?? "running");
}

/** The text of a running state's badge: its time, attempt and so on. */
export function elapsed(node: StateNode, state: StateRun, now: number) {
  const since = (ns: number | null | undefined) => Math.max(0, now - (ms(ns) ?? now)) / 1000;
  const attempt = state.attempt ?? 1;
  if (since(state.since) * 1000 < BRIEF_MS && !state.preempt && attempt < 2) return "";
  const parts = [];
  if (isInCleanup(node)) parts.push("tidying up");
  if (state.item != null) parts.push(`#${state.item + 1}`);
  if (state.resource) parts.push(shorten(state.resource, 40));
  if (attempt > 1) parts.push(`attempt ${attempt}`);
  if (!state.preempt) parts.push(duration(since(state.since)));
  else if (state.serviced) parts.push(`cleans up ${duration(since(state.serviced))}`);
  else {
    const grace = state.asked?.grace;
    parts.push(`asked to stop ${duration(since(state.preempt))}${grace != null ? ` of ${duration(grace)}` : ""}`);
  }
  return parts.join(" \u00b7 ");
}

/** The number of tokens in each place of a plan; an exec place has 1 while its action runs. */
export function tokensIn(plan: StateNode, state: StateRun | undefined) {
  const counts: Map<string, number> = new Map();
  if (state?.marking) for (const place of state.marking) counts.set(place, (counts.get(place) ?? 0) + 1);
  else for (const child of plan.children) counts.set(child.label, child.tokens ?? 0);
  return (label: string) => counts.get(label) ?? 0;
}

/** The places in which a transition lacks tokens, as text; "" for none. */
export function lackOf(plan: StateNode, transition: StateNode, tokensOf: (label: string) => number) {
  const inputs = plan.links.filter((link) => link.target === transition.label).map((link) => link.source);
  const empty = plan.children.filter((child) => inputs.includes(child.label) && !tokensOf(child.label));
  const places = empty.filter(isPartOfNet).map((child) => child.name);
  return places.length ? `lacks tokens in ${places.join(", ")}` : "";
}
