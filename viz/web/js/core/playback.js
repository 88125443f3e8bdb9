// Replay of a run: the instant to show at each moment, and the events that are targets of jumps.
import { countWhile } from "#core/lists.js";
import { endClass, outcomeClass } from "#core/outcomes.js";

export const RATES = [0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];
const MOST_KEYS = 200; // userdata keys whose changes are targets of jumps

/** @typedef {"failure" | "preempt" | "goal"} Kind */
/** @typedef {{ number: number, t: number, path: string, kind: string, outcome: string }} Mark by number of event */

/**
 * The instant that is shown at a moment [ms].
 * @param {{ t: number, since: number, rate: number }} playing from the instant `t`, since the moment `since`
 * @param {number} moment
 */
export const instantAt = ({ t, since, rate }, moment) => t + (moment - since) * rate;

/** @typedef {{ from: number, to: number }} Stretch of a run [ms] */

/**
 * The instant in a loop over a stretch; playing may begin before it.
 * @param {number} t
 * @param {Stretch} stretch
 */
export const loopedAt = (t, { from, to }) => (t < to ? t : from + ((t - from) % Math.max(1, to - from)));

const FRAME_MS = 200; // shortest time between two frames of a film
const MOST_FRAMES = 150;

/**
 * The instants of a film of a stretch; a long stretch is shown faster than real time.
 * @param {Stretch} stretch
 */
export function framesOf({ from, to }) {
  const step = Math.max(FRAME_MS, (to - from) / MOST_FRAMES);
  const count = Math.max(1, Math.ceil((to - from) / step));
  const instants = Array.from({ length: count }, (_, i) => Math.min(to, from + i * step));
  return [...instants, to];
}
export const FILM_FRAME_MS = FRAME_MS;

/**
 * Make unchanged pixels transparent: a film in which little moves is small.
 * @param {Uint32Array} now
 * @param {Uint32Array} before
 * @param {Uint8Array} indexes of `now` in the palette
 * @param {number} transparent index
 * @returns {boolean} whether any pixel has changed
 */
export function keepUnchanged(now, before, indexes, transparent) {
  let isOther = false;
  for (let i = 0; i < now.length; i++)
    if (now[i] === before[i]) indexes[i] = transparent;
    else isOther = true;
  return isOther;
}

/**
 * The seconds since the beginning from a text such as 32.5, 01:02 or 1:02:03.25; null if it is invalid.
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
  #count = 0; // number of events, including the dropped ones
  #gone = 0;
  /** @type {Set<string>} keys of userdata that were written */
  keys = new Set();

  /** @param {RunEvent[]} events */
  push(events) {
    for (const e of events) {
      this.#count += 1;
      const mark = { number: this.#count, t: e.stamp_ns / 1e6, path: e.path, kind: e.kind, outcome: e.outcome };
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

  /** Drop the marks of the oldest events of the run. @param {number} count number of further dropped events */
  forget(count) {
    this.#gone += count;
    for (const marks of this.#marks.values()) {
      const kept = marks.findIndex((mark) => mark.number > this.#gone);
      marks.splice(0, kept < 0 ? marks.length : kept);
    }
  }

  /**
   * The number of events up to the next or previous mark; null if there is none. Marks at one instant count as one, and
   * of failures only those that did not come from a state inside.
   * @param {string} name "kind failure", "kind preempt", "kind goal", or "key NAME"
   * @param {number} shown number of kept events up to the instant shown
   * @param {number} step 1: after it, -1: before
   * @param {import("#core/model.js").Model | null} model
   */
  find(name, shown, step, model) {
    const marks = this.#marks.get(name) ?? [];
    const at = shown + this.#gone;
    const count = countWhile(marks, (mark) => mark.number <= at);
    const here = count > 0 && marks[count - 1].number === at ? marks[count - 1].t : null;
    for (let i = step > 0 ? count : count - 1; i >= 0 && i < marks.length; i += step)
      if (marks[i].t !== here && isOrigin(marks[i], model)) return marks[i].number - this.#gone;
    return null;
  }
}

/**
 * Whether a mark is an origin: not a monitor, nor a container that passes on the failure of a state inside.
 * @param {Mark} mark
 * @param {import("#core/model.js").Model | null} model
 */
function isOrigin({ kind, path, outcome }, model) {
  const node = kind === "Left" ? model?.get(path) : undefined;
  return !node || (!node.children.length && endClass(node, outcome) === "failure");
}
