// Replay of a run: the instant to show at each moment, and the events that are targets of jumps.

import { countWhile } from "#core/lists.ts";
import type { Model } from "#core/model.ts";
import { endClass, outcomeClass } from "#core/outcomes.ts";
import type { RunEvent } from "#core/types.ts";

export const RATES = [0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];
const MOST_KEYS = 200; // userdata keys whose changes are targets of jumps

export type Kind = "failure" | "preempt" | "goal";
/** by number of event */
export type Mark = { number: number; t: number; path: string; kind: string; outcome: string };

/**
 * The instant that is shown at a moment [ms].
 * @param playing from the instant `t`, since the moment `since`
 */
export const instantAt = ({ t, since, rate }: { t: number; since: number; rate: number }, moment: number) =>
  t + (moment - since) * rate;

/** of a run [ms] */
export type Stretch = { from: number; to: number };

/** The instant in a loop over a stretch; playing may begin before it. */
export const loopedAt = (t: number, { from, to }: Stretch) =>
  t < to ? t : from + ((t - from) % Math.max(1, to - from));

const FRAME_MS = 200; // shortest time between two frames of a film
const MOST_FRAMES = 150;

/** The instants of a film of a stretch; a long stretch is shown faster than real time. */
export function framesOf({ from, to }: Stretch) {
  const step = Math.max(FRAME_MS, (to - from) / MOST_FRAMES);
  const count = Math.max(1, Math.ceil((to - from) / step));
  const instants = Array.from({ length: count }, (_, i) => Math.min(to, from + i * step));
  return [...instants, to];
}
export const FILM_FRAME_MS = FRAME_MS;

/** The seconds since the beginning from a text such as 32.5, 01:02 or 1:02:03.25; null if it is invalid. */
export function parseInstant(text: string) {
  const found = /^(?:(?:(\d{1,4}):)?(\d{1,5}):)?(\d{1,7}(?:\.\d{0,6})?)$/.exec(text.trim());
  if (!found) return null;
  const [, hours, minutes, seconds] = found;
  return Number(hours ?? 0) * 3600 + Number(minutes ?? 0) * 60 + Number(seconds);
}

function kindOf(e: RunEvent): Kind | null {
  if (e.kind === "Failed" || (e.kind === "Left" && outcomeClass(e.outcome) === "failure")) return "failure";
  if (e.kind === "GoalDone") return outcomeClass(e.status) === "failure" ? "failure" : null;
  if (e.kind === "PreemptRequested") return "preempt";
  return e.kind === "GoalSent" ? "goal" : null;
}

const outcomeOf = (e: RunEvent) => ("outcome" in e && e.outcome) || "";

export class Marks {
  /** by kind, and by key of userdata */
  #marks: Map<string, Mark[]> = new Map();
  #count = 0; // number of events, including the dropped ones
  #gone = 0;
  /** keys of userdata that were written */
  keys: Set<string> = new Set();

  push(events: RunEvent[]) {
    for (const e of events) {
      this.#count += 1;
      const mark = { number: this.#count, t: e.stamp_ns / 1e6, path: e.path, kind: e.kind, outcome: outcomeOf(e) };
      const kind = kindOf(e);
      if (kind) this.#add(`kind ${kind}`, mark);
      if (e.kind !== "UserdataWritten" || (!this.keys.has(e.key) && this.keys.size >= MOST_KEYS)) continue;
      this.keys.add(e.key);
      this.#add(`key ${e.key}`, mark);
    }
  }

  #add(name: string, mark: Mark) {
    const known = this.#marks.get(name);
    if (known) known.push(mark);
    else this.#marks.set(name, [mark]);
  }

  /** Drop the marks of the oldest events of the run. @param count number of further dropped events */
  forget(count: number) {
    this.#gone += count;
    for (const marks of this.#marks.values()) {
      const kept = marks.findIndex((mark) => mark.number > this.#gone);
      marks.splice(0, kept < 0 ? marks.length : kept);
    }
  }

  /**
   * The number of events up to the next or previous mark; null if there is none. Marks at one instant count as one, and
   * of failures only those that did not come from a state inside.
   * @param name "kind failure", "kind preempt", "kind goal", or "key NAME"
   * @param shown number of kept events up to the instant shown
   * @param step 1: after it, -1: before
   */
  find(name: string, shown: number, step: number, model: Model | null) {
    const marks = this.#marks.get(name) ?? [];
    const at = shown + this.#gone;
    const count = countWhile(marks, (mark) => mark.number <= at);
    const here = count > 0 && marks[count - 1].number === at ? marks[count - 1].t : null;
    for (let i = step > 0 ? count : count - 1; i >= 0 && i < marks.length; i += step)
      if (marks[i].t !== here && isOrigin(marks[i], model)) return marks[i].number - this.#gone;
    return null;
  }
}

/** Whether a mark is an origin: not a monitor, nor a container that passes on the failure of a state inside. */
function isOrigin({ kind, path, outcome }: Mark, model: Model | null) {
  const node = kind === "Left" ? model?.get(path) : undefined;
  return !node || (!node.children.length && endClass(node, outcome) === "failure");
}
