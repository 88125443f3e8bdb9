// Numbers over time, for plots: fields of feedback, userdata and topics, and the progress of goals.
// The id of a series says where its numbers come from, so that an address can name it.

import { containerOf } from "#core/fold.ts";
import { countUntil } from "#core/scene.ts";
import type { Progress, RunEvent, RunState, Series } from "#core/types.ts";
import { branchOf, fieldsOf, isTree } from "#core/values.ts";

const MOST_POINTS = 20_000; // of one series
const MOST_FIELDS = 60; // of one value, in the choice of series
const MOST_ITEMS = 8; // of a list
const MOST_DEPTH = 6;
const MOST_CHOICES = 400;
const LONGEST_ID = 400; // characters
export const MOST_PLOTS = 6;
const JUST_MS = 1e-3; // time between an event and the break of a line before or after it
export const MOST_LINES = 8; // in one plot: the number of colours

/** at an instant [ms]; null: unknown from there on */
export type Sample = { t: number; value: number | null };
export type Source = "feedback" | "progress" | "userdata" | "topic";

/** The origin of a series: `owner` is a container for userdata, otherwise an action or the name of a topic's value. */
export type Origin = { source: Source; owner: string; path: string[] };

const SOURCES: Source[] = ["feedback", "progress", "userdata", "topic"];
/** label, unit, value */
const PROGRESS: Record<string, [string, string, (progress: Progress) => number | null]> = {
  distance: ["distance left", "m", ({ distance }) => distance],
  fraction: ["progress", "%", ({ fraction }) => (fraction === null ? null : 100 * fraction)],
};

export const idOf = ({ source, owner, path }: Origin) => [source, owner, ...path].map(encodeURIComponent).join(",");

/** The origin of an id; null if it is invalid. */
export function originOf(id: string): Origin | null {
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

/** Plots as lists of ids; invalid ones are left out. */
export function knownPlots(plots: unknown): string[][] {
  if (!Array.isArray(plots)) return [];
  const lines = (plot: unknown) =>
    (Array.isArray(plot) ? plot : []).filter((id) => typeof id === "string" && originOf(id)).slice(0, MOST_LINES);
  return plots
    .map(lines)
    .filter((plot) => plot.length)
    .slice(0, MOST_PLOTS);
}

export function labelOf({ source, owner, path }: Origin) {
  if (source === "progress") return PROGRESS[path[0]][0];
  if (source === "feedback") return path.slice(-2).join(".");
  return source === "userdata" ? path.join(".") : [owner, ...path].join(".");
}

/** The part of the origin that the label leaves out. */
export const ownerOf = ({ source, owner }: Origin) => (source === "topic" ? "" : owner);

export const unitOf = ({ source, path }: Origin) => (source === "progress" ? PROGRESS[path[0]][1] : "");

/** The named parts of a value; null if it has none. */
function partsOf(value: unknown): [string, unknown][] | null {
  const fields = fieldsOf(value);
  if (fields) return Object.entries(fields).slice(0, MOST_FIELDS);
  const branch = branchOf(value);
  if (typeof branch === "string") return null;
  const most = Array.isArray(value) ? MOST_ITEMS : MOST_FIELDS;
  return branch.parts.slice(0, most).map(([name, part], i) => [unquoted(name) ?? String(i), part]);
}

/** @param name of a dict's item as Python writes it */
const unquoted = (name: string | null) => name?.replace(/^(['"])(.*)\1$/, "$2");

/** A value as a number; true is 1. Null if it is not a number. */
function numberOf(value: unknown) {
  if (typeof value === "boolean") return value ? 1 : 0;
  const number = isTree(value) && typeof value.$int === "string" ? Number(value.$int) : value;
  return typeof number === "number" && Number.isFinite(number) ? number : null;
}

/** The number at a path within a value; null if there is none. */
function numberAt(whole: unknown, path: string[]) {
  let value = whole;
  for (const name of path) {
    const part = partsOf(value)?.find(([one]) => one === name);
    if (!part) return null;
    value = part[1];
  }
  return numberOf(value);
}

/** Paths of the numbers in a value. */
export function numbersIn(value: unknown): string[][] {
  const found: string[][] = [];
  const look = (one: unknown, path: string[]) => {
    if (found.length >= MOST_FIELDS) return;
    if (numberOf(one) !== null) found.push(path);
    else if (path.length < MOST_DEPTH) for (const [name, part] of partsOf(one) ?? []) look(part, [...path, name]);
  };
  look(value, []);
  return found;
}

/**
 * The series that can be plotted for a run, by its newest values.
 * @param topics names of topics' values
 */
export function originsIn(data: RunState, topics: Iterable<string>): Origin[] {
  const found: Map<string, Origin> = new Map();
  const add = (source: Source, owner: string, path: string[]) => {
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
 * @param topics names of topics' values
 */
export function usualPlots(data: RunState, topics: Iterable<string>): string[][] {
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
  id: string;
  origin: Origin;
  isStep: boolean;
  list: Sample[] = [];
  #read = 0; // number of events that were read, including those the run has dropped since
  #run: unknown = null;
  #goal = ""; // id of the goal with the newest feedback

  constructor(id: string) {
    this.id = id;
    this.origin = originOf(id) as Origin;
    this.isStep = this.origin.source === "userdata"; // a value holds until the next one is written
  }

  update(run: { events: RunEvent[]; forgotten: number }, topics: Map<string, Series>) {
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

  #take(e: RunEvent) {
    const { source, owner, path } = this.origin;
    if (source === "userdata") {
      if (e.kind === "UserdataWritten" && e.key === path[0] && containerOf(e.path) === owner)
        this.#put(e, numberAt(e.value, path.slice(1)));
      return;
    }
    if (!("action" in e) || e.action !== owner) return;
    if (e.kind === "GoalFeedback") {
      if (e.goal_id !== this.#goal) this.#put(e, null, -JUST_MS); // no line from one goal to the next
      this.#goal = e.goal_id;
      if (source === "feedback") this.#put(e, numberAt(e.feedback, path));
      else if (e.progress) this.#put(e, PROGRESS[path[0]][2](e.progress));
    } else if (e.kind === "GoalDone" && e.goal_id === this.#goal) this.#put(e, null, JUST_MS);
  }

  /** @param later [ms] */
  #put(e: RunEvent, value: number | null, later: number = 0) {
    if (value !== null || this.list.length) this.list.push({ t: e.stamp_ns / 1e6 + later, value });
  }
}

/** The value at an instant; null if it is unknown. */
export const valueAt = (list: Sample[], t: number) => list[countUntil(list, t) - 1]?.value ?? null;

/** A number for people. */
export function numberText(value: number) {
  const size = Math.abs(value);
  if (value === 0 || (Number.isInteger(value) && size < 1e6)) return String(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(2);
  return String(Number(value.toPrecision(size < 0.01 ? 2 : 4)));
}

/**
 * Several series on one axis of instants, as uPlot needs them: `undefined` where a series has no sample, null where
 * its line is broken.
 * @param from [ms]
 * @param now the instant up to which values are known [ms]
 */
export function aligned(
  all: Samples[],
  from: number,
  to: number,
  now: number,
): [number[], ...(number | null | undefined)[][]] {
  const windows = all.map(({ list, isStep }) => {
    // With one sample before and one after the range, so that lines continue to its edges.
    const shown = list.slice(Math.max(0, countUntil(list, from) - 1), countUntil(list, to) + 1);
    const last = shown.at(-1);
    return isStep && last && last.t < now ? [...shown, { t: now, value: last.value }] : shown;
  });
  const instants = [...new Set(windows.flatMap((list) => list.map((one) => one.t)))].sort((a, b) => a - b);
  const place = new Map(instants.map((t, i) => [t, i]));
  const columns = windows.map((list) => {
    const column: (number | null | undefined)[] = new Array(instants.length).fill(undefined);
    for (const { t, value } of list) column[place.get(t) as number] = value;
    return column;
  });
  return [instants, ...columns];
}
