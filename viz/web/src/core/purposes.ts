// What a goal or a state is for, in a few words: "kitchen", "(3.2, 1.0)".

import { own } from "#core/fold.ts";
import { isInCleanup } from "#core/model.ts";
import { placeText } from "#core/places.ts";
import { store } from "#core/store.ts";
import { duration, shorten } from "#core/text.ts";
import type { GoalRun, Span } from "#core/types.ts";
import { fieldsOf } from "#core/values.ts";

const NAMES = ["name", "station", "place", "waypoint", "location", "target", "object", "item", "text"];

/** Where a goal leads, or what it is about; "" if neither can be said in a few words. */
export function purposeOf(id: string, { goal }: Pick<GoalRun, "goal">) {
  const { scene } = store.data;
  const driven = scene.goalWithId(id);
  if (driven) return scene.placeName(driven) || placeText(driven);
  const fields = fieldsOf(goal) ?? {};
  for (const name of NAMES) if (typeof fields[name] === "string" && fields[name]) return shorten(fields[name], 24);
  return "";
}

/** A goal in words: "move_base \u2192 kitchen, 3.1 m left". */
export function goalText(id: string, goal: GoalRun) {
  const purpose = purposeOf(id, goal);
  const left = goal.progress?.distance;
  const name = goal.action.replace(/^\//, "");
  return `${name}${purpose ? ` \u2192 ${purpose}` : ""}${left == null ? "" : `, ${left.toFixed(1)} m left`}`;
}

/** Where a visit leads, or what it is about; "" if that is not known. */
export function purposeOfVisit(span: Span) {
  if (span.note) return shorten(span.note, 40);
  if (span.purpose !== undefined) return span.purpose;
  const found = span.sent ? purposeOf(span.sent.id, span.sent) : "";
  if (span.to !== null) span.purpose = found; // later names of places are not looked for
  return found;
}

/** "attempt 2 of 3", where the machine says how many there are at most. */
export function attemptText(path: string, attempt: number) {
  const retry = store.data.model.value?.get(path)?.details.find(([name]) => name === "retry")?.[1] ?? "";
  const most = /^(\d+) attempts/.exec(retry)?.[1];
  return `attempt ${attempt}${most ? ` of ${most}` : ""}`;
}

/** Whether a state is a clean-up, or in one. */
const tidies = (path: string) => isInCleanup(store.data.model.value?.get(path));

/**
 * What a bar says about a visit, the longest text first.
 * @param now [ms]
 */
export function wordsOf(name: string, span: Span, now: number) {
  const took = duration(Math.max(0, Math.min(span.to ?? now, now) - span.from) / 1000);
  const purpose = purposeOfVisit(span);
  const runs = span.to === null || span.to > now;
  const facts = [
    (span.attempt ?? 1) > 1 && attemptText(span.path, span.attempt ?? 1),
    tidies(span.path) && (runs ? "tidying up" : "tidied up"),
    runs && span.serviced !== null && span.serviced <= now && "cleaning up",
  ].filter(Boolean);
  const more = facts.map((fact) => `, ${fact}`).join("");
  const to = purpose && `\u2192 ${purpose}`;
  const all = [
    `${name}${to && ` ${to}`}${more} ${took}`,
    `${name}${to && ` ${to}`}${more}`,
    to && `${to}${more} ${took}`,
    to || name,
    purpose || name,
  ];
  return [...new Set(all.filter(Boolean))];
}

/** What a closed branch does, or how it ended, in a few words. */
export function insideText(path: string) {
  const leaf = store.status.activeLeaves.value.find((one) => one.startsWith(`${path}/`));
  if (leaf) return `${leaf.slice(leaf.lastIndexOf("/") + 1)} ${purposeOfState(leaf)}`.trim();
  const state = own(store.playback.shown().states, path);
  if (!state?.visits) return "not begun";
  return state.since != null ? purposeOfState(path) : (state.error ?? state.outcome ?? "");
}

/** The purpose of a running state as text behind its name; "" without one. */
export function purposeOfState(path: string) {
  const span = store.data.run.open.get(path);
  const purpose = span ? purposeOfVisit(span) : "";
  return [tidies(path) && "tidying up", purpose && `\u2192 ${purpose}`].filter(Boolean).join(" ");
}
