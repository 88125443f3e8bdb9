// Numbers over time, for plots: fields of feedback, userdata and topics, and the progress of goals.
// The id of a series says where its numbers come from, so that an address can name it.
import { containerOf } from "#core/fold.js";
import { parseRepr } from "#core/repr.js";
import { countUntil } from "#core/scene.js";

const MOST_POINTS = 20_000; // of one series
const MOST_FIELDS = 60; // of one value, in the choice of series
const MOST_ITEMS = 8; // of a list
const MOST_DEPTH = 6;
const MOST_CHOICES = 400;
const LONGEST_ID = 400; // characters
export const MOST_PLOTS = 6;
const JUST_MS = 1e-3; // time between an event and the break of a line before or after it
export const MOST_LINES = 8; // in one plot: the number of colours

/** @typedef {{ t: number, value: number | null }} Sample at an instant [ms]; null: unknown from there on */
/** @typedef {"feedback" | "progress" | "userdata" | "topic"} Source */
/** @typedef {import("#core/repr.js").Tree} Tree */

/** The origin of a series: `owner` is a container for userdata, otherwise an action or the name of a topic's value. */
/** @typedef {{ source: Source, owner: string, path: string[] }} Origin */

/** @type {Source[]} */
const SOURCES = ["feedback", "progress", "userdata", "topic"];
/** @type {Record<string, [string, string, (progress: Progress) => number | null]>} label, unit, value */
const PROGRESS = {
  distance: ["distance left", "m", ({ distance }) => distance],
  fraction: ["progress", "%", ({ fraction }) => (fraction === null ? null : 100 * fraction)],
};

/** @param {Origin} origin */
export const idOf = ({ source, owner, path }) => [source, owner, ...path].map(encodeURIComponent).join(",");

/** The origin of an id; null if it is invalid. @param {string} id @returns {Origin | null} */
export function originOf(id) {
  if (id.length > LONGEST_ID) return null;
  try {
    const [word, owner, ...path] = id.split(",").map(decodeURIComponent);
    const source = SOURCES.find((one) => one === word);
    const needsPath = source === "userdata" || source === "feedback" || source === "progress";
    if (!source || !owner || (needsPath && !path.length)) return null;
    return source === "progress" && !Object.hasOwn(PROGRESS, path[0]) ? null : { source, owner, path };
  } catch {
    return null; // an invalid % sequence
  }
}

/** Plots as lists of ids; invalid ones are left out. @param {unknown} plots @returns {string[][]} */
export function knownPlots(plots) {
  if (!Array.isArray(plots)) return [];
  const lines = (/** @type {unknown} */ plot) =>
    (Array.isArray(plot) ? plot : []).filter((id) => typeof id === "string" && originOf(id)).slice(0, MOST_LINES);
  return plots
    .map(lines)
    .filter((plot) => plot.length)
    .slice(0, MOST_PLOTS);
}

/** @param {Origin} origin */
export function labelOf({ source, owner, path }) {
  if (source === "progress") return PROGRESS[path[0]][0];
  if (source === "feedback") return path.slice(-2).join(".");
  return source === "userdata" ? path.join(".") : [owner, ...path].join(".");
}

/** The part of the origin that the label leaves out. @param {Origin} origin */
export const ownerOf = ({ source, owner }) => (source === "topic" ? "" : owner);

/** @param {Origin} origin */
export const unitOf = ({ source, path }) => (source === "progress" ? PROGRESS[path[0]][1] : "");

/**
 * The named parts of a value; null if it has none.
 * @param {any} value
 * @returns {[string, any][] | null}
 */
function partsOf(value) {
  if (typeof value === "string") {
    const tree = parseRepr(value);
    return tree && partsOfTree(tree);
  }
  if (Array.isArray(value)) return value.slice(0, MOST_ITEMS).map((item, i) => [String(i), item]);
  if (value === null || typeof value !== "object") return null;
  if ("name" in value && Array.isArray(value.items) && "end" in value) return partsOfTree(value);
  return Object.entries(value.$msg ? (value.fields ?? {}) : value);
}

/** @param {import("#core/repr.js").Branch} tree @returns {[string, Tree][]} */
const partsOfTree = ({ items }) =>
  items.slice(0, MOST_FIELDS).map(([name, item], i) => [unquoted(name) ?? `${i}`, item]);

/** @param {string | null} name of a dict's item as in Python's repr */
const unquoted = (name) => name?.replace(/^(['"])(.*)\1$/, "$2");

/** A value as a number; true is 1. Null if it is not a number. @param {any} value */
function numberOf(value) {
  if (typeof value === "boolean" || value === "True" || value === "False")
    return value === true || value === "True" ? 1 : 0;
  const number = typeof value === "string" && /^-?[\d.]+(?:e[+-]?\d+)?$/i.test(value) ? Number(value) : value;
  return typeof number === "number" && Number.isFinite(number) ? number : null;
}

/** The number at a path within a value; null if there is none. @param {any} value @param {string[]} path */
function numberAt(value, path) {
  for (const name of path) {
    const part = partsOf(value)?.find(([one]) => one === name);
    if (!part) return null;
    value = part[1];
  }
  return numberOf(value);
}

/**
 * Paths of the numbers in a value.
 * @param {any} value
 * @returns {string[][]}
 */
export function numbersIn(value) {
  /** @type {string[][]} */
  const found = [];
  const look = (/** @type {any} */ one, /** @type {string[]} */ path) => {
    if (found.length >= MOST_FIELDS) return;
    if (numberOf(one) !== null) found.push(path);
    else if (path.length < MOST_DEPTH) for (const [name, part] of partsOf(one) ?? []) look(part, [...path, name]);
  };
  look(value, []);
  return found;
}

/**
 * The series that can be plotted for a run, by its newest values.
 * @param {RunState} data
 * @param {Iterable<string>} topics names of topics' values
 * @returns {Origin[]}
 */
export function originsIn(data, topics) {
  /** @type {Map<string, Origin>} */
  const found = new Map();
  const add = (/** @type {Source} */ source, /** @type {string} */ owner, /** @type {string[]} */ path) => {
    const origin = { source, owner, path };
    if (found.size < MOST_CHOICES) found.set(idOf(origin), origin);
  };
  for (const name of topics) add("topic", name, []);
  for (const goal of Object.values(data.goals))
    for (const name of Object.keys(PROGRESS))
      if (goal.progress && PROGRESS[name][2](goal.progress) !== null) add("progress", goal.action, [name]);
  for (const { container, key, value } of Object.values(data.userdata))
    for (const path of numbersIn(value)) add("userdata", container, [key, ...path]);
  for (const goal of Object.values(data.goals))
    for (const path of numbersIn(goal.feedback)) if (path.length) add("feedback", goal.action, path);
  return [...found.values()].filter((origin) => originOf(idOf(origin)));
}

/**
 * The default plots of a run: batteries, and the remaining distances of goals.
 * @param {RunState} data
 * @param {Iterable<string>} topics names of topics' values
 * @returns {string[][]}
 */
export function usualPlots(data, topics) {
  const batteries = [...topics].filter((name) => /(^|\/)battery$/.test(name));
  const actions = new Set(
    Object.values(data.goals)
      .filter((goal) => goal.progress?.distance != null)
      .map((goal) => goal.action),
  );
  return knownPlots([
    batteries.sort().map((owner) => idOf({ source: "topic", owner, path: [] })),
    [...actions].sort().map((owner) => idOf({ source: "progress", owner, path: ["distance"] })),
  ]);
}

/** The samples of one series, read from the run's events as they come. */
export class Samples {
  /** @type {Sample[]} */
  list = [];
  #read = 0; // number of events that were read, including those the run has dropped since
  /** @type {unknown} */
  #run = null;
  #goal = ""; // id of the goal with the newest feedback

  /** @param {string} id */
  constructor(id) {
    this.id = id;
    this.origin = /** @type {Origin} */ (originOf(id));
    this.isStep = this.origin.source === "userdata"; // a value holds until the next one is written
  }

  /**
   * @param {{ events: RunEvent[], forgotten: number }} run
   * @param {Map<string, Series>} topics
   */
  update(run, topics) {
    const { source, owner } = this.origin;
    if (source === "topic") {
      this.list = topics.get(owner)?.points ?? [];
      return this.list;
    }
    if (this.#run !== run) {
      this.#run = run;
      this.#read = run.forgotten;
      this.list = [];
    }
    const first = Math.max(0, this.#read - run.forgotten);
    for (let i = first; i < run.events.length; i++) this.#take(run.events[i]);
    this.#read = run.forgotten + run.events.length;
    if (this.list.length > MOST_POINTS) this.list.splice(0, MOST_POINTS / 4);
    return this.list;
  }

  /** @param {RunEvent} e */
  #take(e) {
    const { source, owner, path } = this.origin;
    if (source === "userdata") {
      if (e.kind === "UserdataWritten" && e.key === path[0] && containerOf(e.path) === owner)
        this.#put(e, numberAt(e.value, path.slice(1)));
      return;
    }
    if (e.action !== owner) return;
    if (e.kind === "GoalFeedback") {
      if (e.goal_id !== this.#goal) this.#put(e, null, -JUST_MS); // no line from one goal to the next
      this.#goal = e.goal_id;
      if (source === "feedback") this.#put(e, numberAt(e.feedback, path));
      else if (e.progress) this.#put(e, PROGRESS[path[0]][2](e.progress));
    } else if (e.kind === "GoalDone" && e.goal_id === this.#goal) this.#put(e, null, JUST_MS);
  }

  /** @param {RunEvent} e @param {number | null} value @param {number} later [ms] */
  #put(e, value, later = 0) {
    if (value !== null || this.list.length) this.list.push({ t: e.stamp_ns / 1e6 + later, value });
  }
}

/** The value at an instant; null if it is unknown. @param {Sample[]} list @param {number} t */
export const valueAt = (list, t) => list[countUntil(list, t) - 1]?.value ?? null;

/** A number for people. @param {number} value */
export function numberText(value) {
  const size = Math.abs(value);
  if (value === 0 || (Number.isInteger(value) && size < 1e6)) return String(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(2);
  return String(Number(value.toPrecision(size < 0.01 ? 2 : 4)));
}

/**
 * Several series on one axis of instants, as uPlot needs them: `undefined` where a series has no sample, null where
 * its line is broken.
 * @param {Samples[]} all
 * @param {number} from [ms] @param {number} to
 * @param {number} now the instant up to which values are known [ms]
 * @returns {[number[], ...(number | null | undefined)[][]]}
 */
export function aligned(all, from, to, now) {
  const windows = all.map(({ list, isStep }) => {
    // With one sample before and one after the range, so that lines continue to its edges.
    const shown = list.slice(Math.max(0, countUntil(list, from) - 1), countUntil(list, to) + 1);
    const last = shown.at(-1);
    return isStep && last && last.t < now ? [...shown, { t: now, value: last.value }] : shown;
  });
  const instants = [...new Set(windows.flatMap((list) => list.map((one) => one.t)))].sort((a, b) => a - b);
  const place = new Map(instants.map((t, i) => [t, i]));
  const columns = windows.map((list) => {
    /** @type {(number | null | undefined)[]} */
    const column = new Array(instants.length).fill(undefined);
    for (const { t, value } of list) column[/** @type {number} */ (place.get(t))] = value;
    return column;
  });
  return [instants, ...columns];
}
