// Playing a run again: the instant at a moment, and the events that one may jump to.
import { outcomeClass } from "#core/outcomes.js";

export const RATES = [0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];
const WATCHING = ["monitor", "condition"]; // what they find, "invalid" too, is no failure
const MOST_KEYS = 200; // of userdata that are followed

/** @typedef {"failure" | "preempt" | "goal"} Kind */
/** @typedef {{ number: number, t: number, path: string, kind: string }} Mark an event, by its number in the run */

/**
 * The instant that is shown at a moment [ms].
 * @param {{ t: number, since: number, rate: number }} playing from the instant `t`, since the moment `since`
 * @param {number} moment
 */
export const instantAt = ({ t, since, rate }, moment) => t + (moment - since) * rate;

/**
 * Seconds since the beginning of what was typed, such as 32.5, 01:02 or 1:02:03.25; null: it is none.
 * @param {string} text
 */
export function parseInstant(text) {
  const found = /^(?:(?:(\d{1,4}):)?(\d{1,5}):)?(\d{1,7}(?:\.\d{0,6})?)$/.exec(text.trim());
  if (!found) return null;
  const [, hours, minutes, seconds] = found;
  return Number(hours ?? 0) * 3600 + Number(minutes ?? 0) * 60 + Number(seconds);
}

/** @param {RunEvent} e @returns {Kind | null} */
function kindOf(e) {
  if (e.kind === "Failed" || (e.kind === "Left" && outcomeClass(e.outcome) === "failure")) return "failure";
  if (e.kind === "GoalDone") return outcomeClass(e.status) === "failure" ? "failure" : null;
  if (e.kind === "PreemptRequested") return "preempt";
  return e.kind === "GoalSent" ? "goal" : null;
}

export class Marks {
  /** @type {Map<string, Mark[]>} by kind, and by key of userdata */
  #marks = new Map();
  #count = 0; // of events, those that were forgotten too
  #gone = 0;
  /** @type {Set<string>} keys of userdata that were written */
  keys = new Set();

  /** @param {RunEvent[]} events */
  push(events) {
    for (const e of events) {
      this.#count += 1;
      const mark = { number: this.#count, t: e.stamp_ns / 1e6, path: e.path, kind: e.kind };
      const kind = kindOf(e);
      if (kind) this.#add(`kind ${kind}`, mark);
      if (e.kind !== "UserdataWritten" || (!this.keys.has(e.key) && this.keys.size >= MOST_KEYS)) continue;
      this.keys.add(e.key);
      this.#add(`key ${e.key}`, mark);
    }
  }

  /** @param {string} name @param {Mark} mark */
  #add(name, mark) {
    const known = this.#marks.get(name);
    if (known) known.push(mark);
    else this.#marks.set(name, [mark]);
  }

  /** The oldest events of the run are forgotten. @param {number} count */
  forget(count) {
    this.#gone += count;
    for (const marks of this.#marks.values()) {
      const kept = marks.findIndex((mark) => mark.number > this.#gone);
      marks.splice(0, kept < 0 ? marks.length : kept);
    }
  }

  /**
   * So many events have happened at the next mark, or the one before; null: there is none.
   * Marks of one instant are one; of failures those count that began one.
   * @param {string} name "kind failure", "kind preempt", "kind goal", or "key NAME"
   * @param {number} shown so many of the kept events have happened by what is shown
   * @param {number} step 1: after it, -1: before
   * @param {import("#core/model.js").Model | null} model
   */
  find(name, shown, step, model) {
    const marks = this.#marks.get(name) ?? [];
    const at = shown + this.#gone;
    let low = 0;
    let high = marks.length;
    while (low < high) {
      const mid = (low + high) >> 1;
      if (marks[mid].number <= at) low = mid + 1;
      else high = mid;
    }
    const here = low > 0 && marks[low - 1].number === at ? marks[low - 1].t : null;
    for (let i = step > 0 ? low : low - 1; i >= 0 && i < marks.length; i += step)
      if (marks[i].t !== here && isOrigin(marks[i], model)) return marks[i].number - this.#gone;
    return null;
  }
}

/**
 * Whether a state failed by itself: no monitor, and no container that hands on what failed in it.
 * @param {Mark} mark
 * @param {import("#core/model.js").Model | null} model
 */
function isOrigin({ kind, path }, model) {
  const node = kind === "Left" ? model?.get(path) : undefined;
  return !node || (!node.children.length && !WATCHING.includes(node.kind));
}
