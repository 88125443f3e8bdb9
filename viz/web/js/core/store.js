// What the page knows and what its user chose. Panels read signals; the diagram reads `shown()`.
import { batch, computed, signal } from "@preact/signals";
import { arrangementOf, moved, PANELS, placeOf, usual as usualArrangement, wordOf } from "#core/arrangement.js";
import { emptyState, ms, own } from "#core/fold.js";
import { withNotes } from "#core/links.js";
import { Model } from "#core/model.js";
import { instantAt, loopedAt, Marks } from "#core/playback.js";
import { Run } from "#core/run.js";
import { Scene } from "#core/scene.js";
import { knownPlots, MOST_LINES, MOST_PLOTS, usualPlots } from "#core/series.js";
import { shorten } from "#core/text.js";
import { wayOf } from "#core/why.js";

/** @template T @typedef {import("@preact/signals").Signal<T>} Signal */

/** @param {string} name @param {any} fallback */
function saved(name, fallback) {
  try {
    return JSON.parse(localStorage.getItem(`smachpy.${name}`) ?? "null") ?? fallback;
  } catch {
    return fallback; // a file has no storage
  }
}
/** @param {string} name @param {unknown} value */
export function save(name, value) {
  try {
    localStorage.setItem(`smachpy.${name}`, JSON.stringify(value));
  } catch {
    // a file has no storage
  }
}

// -- what the server sends ----------------------------------------------------------------------

/** @type {Signal<"connecting" | "live" | "lost" | "file">} */
export const connection = signal("connecting");
/** @type {Signal<Settings>} */
export const settings = signal({ follow: false, control: false });
/** @type {Signal<MachineSummary[]>} */
export const machines = signal([]);
/** @type {Signal<MachineFacts | null>} */
export const facts = signal(null); // of the machine shown
/** @type {Signal<Problem[]>} */
export const problems = signal([]);
/** @type {Signal<Model | null>} */
export const model = signal(null);
/** @type {Signal<Statistics | null>} */
export const statistics = signal(null);
/** @type {Signal<number | null>} */
export const gap = signal(null); // so many events went by this page
/** @type {Signal<ActionsSeen>} */
export const actions = signal({ actions: [], gone: [], goals: [], known: false });
/** @type {Signal<Comparison | null>} */
export const comparison = signal(null);
/** @type {Signal<string | null>} */
export const failure = signal(null); // why there is nothing to see

// -- what the user chose ------------------------------------------------------------------------

export const wanted = signal(""); // name of the machine to show
/** @type {Signal<string | null>} */
export const selected = signal(null); // path of a state
export const query = signal(""); // of the search
export const follow = signal(false);
/** @type {Signal<boolean>} */
export const implicit = signal(saved("implicit", false));
export const numbers = signal("none"); // a key of statistics.MODES
/** @type {Signal<Theme>} */
export const theme = signal(saved("theme", "system"));
/** @type {Signal<Visit | null>} */
export const hovered = signal(null);
/** @type {Signal<number | null>} */
export const pointed = signal(null); // the instant at which the pointer is, in the timeline or a plot [ms]
/** @type {Signal<Set<string>>} */
export const opened = signal(new Set()); // paths of containers
export const help = signal(false);
/** @type {Signal<boolean>} */
export const sound = signal(saved("sound", true)); // when a question comes
/** @type {Signal<string>} */
export const operator = signal(saved("operator", "")); // the name under which answers are given
export const tokenAsked = signal(false); // the viewer does not take the token that this page has
/** @type {Signal<Why | null>} */
export const why = signal(null); // why the run ended so, while that is shown
/** The ends of states that led to it. */
export const wayShown = computed(() => wayOf(why.value));
export const treeOpen = signal(false); // on small screens, where it lies over the page
export const overview = signal(false); // so many states are open that they are tiles, without arrows
/** @type {Signal<{ done: number, all: number } | null>} */
export const laidOut = signal(null); // so many states, while it takes a while
/** @type {Signal<string | null>} */
export const dismissed = signal(null); // the run before whose notice was closed
export const actionsOpen = signal(false);
export const homeOpen = signal(false); // the list of runs
/** @type {Signal<{ runs: RunRow[], folders: string[], journals: { name: string, problem: string }[] }>} */
export const runs = signal({ runs: [], folders: [], journals: [] });
export const fleetOpen = signal(false); // the live runs together
export const simulateOpen = signal(false); // the dialog of simulated runs
/** @type {Signal<{ missions: Record<string, string>, batches: Batch[] }>} */
export const simulations = signal({ missions: {}, batches: [] });
export const runsKnown = signal(false);
export const runsProblem = signal(""); // why they cannot be listed
/** @type {Signal<Set<string>>} */
export const pins = signal(new Set(saved("pins", []))); // ids of runs
/** @type {Signal<string | null>} */
export const chosenAction = signal(null);
export const logFilter = signal("all");
/** @type {Signal<{ text: string, kind: "info" | "error" } | null>} */
export const notice = signal(null);

// -- the run, now and at an earlier instant -----------------------------------------------------

export const tick = signal(0); // counts the changes that panels should show
export const slowTick = signal(0); // the same, for panels with much text
/** @type {Signal<number | null>} */
export const cursor = signal(null); // the instant shown [ms]; null: now
/** @type {Signal<number | null>} */
const position = signal(null); // so many events have happened there: several may share an instant
export const instant = computed(() => [cursor.value, position.value]);

export let run = new Run(emptyState(), []);
export let scene = new Scene();
export let marks = new Marks(); // what one may jump to
export const hasMap = signal(false); // whether there is anything to show on one
/** @type {RunState | null} */
let stateAtCursor = null;

/** @type {Signal<number>} */
export const rate = signal(saved("rate", 1)); // of playing
/** @type {Signal<{ t: number, since: number, rate: number } | null>} */
export const playing = signal(null);
/** @type {Signal<import("#core/playback.js").Stretch | null>} */
export const stretch = signal(null); // of the run, that is selected [ms]
/** @type {Signal<number | null>} */
export const filmed = signal(null); // so much of a film is drawn [%]
export const looping = signal(false); // whether playing stays in it
/** @type {Signal<string | null>} */
export const followedKey = signal(null); // whose changes one may jump to

/** @param {RunState | null} base @param {RunEvent[]} events */
export function startRun(base, events) {
  run = new Run(base, events);
  scene = new Scene();
  scene.addEvents(events);
  marks = new Marks();
  marks.push(events);
  stateAtCursor = null;
  batch(() => {
    cursor.value = null;
    position.value = null;
    gap.value = null;
    hovered.value = null;
    playing.value = null;
    stretch.value = null;
    looping.value = false;
    followedKey.value = null;
  });
}

export const shown = () => (cursor.value === null ? run.now : (stateAtCursor ?? run.now));

/**
 * Take new events in; the oldest are forgotten when there are more than the server keeps.
 * @param {RunEvent[]} events
 */
export function addEvents(events) {
  run.push(events);
  scene.addEvents(events);
  marks.push(events);
  const gone = run.trim(settings.value.kept ?? Infinity);
  if (gone) marks.forget(gone);
  if (gone && position.value !== null) position.value = Math.max(0, position.value - gone);
}

/** Take in what the robot's topics told. @param {Observed[]} records */
export const addObserved = (records) => scene.addObserved(records);

const SHORTEST_MS = 20; // stretch of a run that can be selected

/** @param {string} id of a run */
export function togglePin(id) {
  const next = new Set(pins.value);
  if (!next.delete(id)) next.add(id);
  pins.value = next;
  save("pins", [...next]);
}

/** The visit that the pointer is on, in the timeline or the map. @param {Visit | null} visit */
export function hover(visit) {
  const before = hovered.value;
  if (before?.path !== visit?.path || before?.from !== visit?.from) hovered.value = visit;
}

/** @param {number | null} t @param {number | null} count */
function show(t, count) {
  stateAtCursor = count === null ? null : run.after(count);
  batch(() => {
    cursor.value = t;
    position.value = count;
    tick.value += 1;
    slowTick.value += 1;
  });
}

/** Show the instant t [ms]; null: now. What plays goes on from there. @param {number | null} t */
export function seek(t) {
  if (t === null) {
    playing.value = null;
    show(null, null);
    return;
  }
  const within = Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
  if (playing.value) playing.value = { t: within, since: performance.now(), rate: rate.value };
  show(within, run.indexAt(within));
}

/** Show what the first `count` events add up to. @param {number} count */
export function seekTo(count) {
  const event = run.events[count - 1];
  playing.value = null;
  if (event) show(event.stamp_ns / 1e6, count);
}

/** Go so many events on, or back. @param {number} step */
export function seekEvent(step) {
  const to = Math.max(1, eventsShown() + step);
  if (to >= run.events.length && step > 0) seek(null);
  else seekTo(Math.min(to, run.events.length));
}

/** Hold the picture, or let it go on: from the beginning when it stands at the end of a run that is over. */
export function togglePlaying() {
  if (playing.value) playing.value = null;
  else if (goes.value) seek(nowMs());
  else {
    const t = cursor.value ?? run.first();
    if (t === null) return;
    playing.value = { t, since: performance.now(), rate: rate.value };
    seek(t);
  }
}

/** Show the instant that has come while playing; at the end that is now. @param {number} moment [ms] */
export function playOn(moment) {
  if (!playing.value) return;
  let t = instantAt(playing.value, moment);
  if (looping.value && stretch.value && t >= stretch.value.to) {
    t = loopedAt(t, stretch.value);
    playing.value = { t, since: moment, rate: rate.value };
  }
  if (t >= (run.last() ?? t)) seek(null);
  else show(t, run.indexAt(t));
}

/** Select a stretch of the run, from one instant to another [ms]; null: none. @param {number} a @param {number} [b] */
export function selectStretch(a, b = a) {
  const inRun = (/** @type {number} */ t) => Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
  const [from, to] = [inRun(Math.min(a, b)), inRun(Math.max(a, b))];
  stretch.value = to - from >= SHORTEST_MS ? { from, to } : null;
  if (!stretch.value) looping.value = false;
}

/** Play a stretch again and again: what is selected, else the visit of the selected state, else the whole run. */
export function toggleLoop() {
  looping.value = !looping.value;
  if (!looping.value) return;
  if (!stretch.value) {
    const visit = selected.value === null ? null : visitAt(selected.value, nowMs());
    if (visit) selectStretch(visit.from, visit.to ?? liveMs());
    else selectStretch(run.first() ?? 0, run.last() ?? 0);
  }
  if (!stretch.value) {
    looping.value = false;
    notify("There is nothing to loop over yet");
    return;
  }
  const { from, to } = stretch.value;
  const t = nowMs();
  playing.value = { t: t >= from && t < to ? t : from, since: performance.now(), rate: rate.value };
  seek(playing.value.t);
}

/** Let the selected stretch begin, or end, at the instant shown. @param {"from" | "to"} end */
export function moveStretch(end) {
  const at = nowMs();
  const other = end === "from" ? (stretch.value?.to ?? run.last()) : (stretch.value?.from ?? run.first());
  const isTurned = other !== null && (end === "from" ? at >= other : at <= other);
  if (other === null || isTurned) notify("The selected stretch would end before it begins", "error");
  else selectStretch(at, other);
}

/** @param {number} factor */
export function setRate(factor) {
  rate.value = factor;
  save("rate", factor);
  if (playing.value) seek(cursor.value);
}

/**
 * So many events have happened at the next mark, or the one before; live, the newest one is the next.
 * @param {string} name @param {number} step
 */
export const jumpOf = (name, step) =>
  marks.find(name, eventsShown(), step, model.value) ??
  (step > 0 && cursor.value === null ? marks.find(name, run.events.length + 1, -1, model.value) : null);

/** Go to a mark; where there is none, say so. @param {string} name of `Marks.find` @param {number} step */
export function jump(name, step) {
  const count = jumpOf(name, step);
  if (count !== null) seekTo(count);
  else notify(`No ${name.replace(/^kind |^key /, "")} ${step > 0 ? "ahead" : "before"}`);
}

/** So many of the kept events have happened by what is shown. */
export const eventsShown = () => position.value ?? run.events.length;

/** The newest visit of a state that had begun at an instant. @param {string} path @param {number} t [ms] */
export const visitAt = (path, t) => run.spans.findLast((one) => one.path === path && one.from <= t) ?? null;

/** The pointer is on something that a state did at an instant; null: on nothing. @param {string | null} path */
export function hoverAt(path, t = nowMs()) {
  const span = path === null ? null : visitAt(path, t);
  hover(span && { path: span.path, from: span.from });
}

/** Whether what a state did at an instant [ms] belongs to the visit that the pointer is on. @param {string} path */
export function isLit(path, /** @type {number} */ t) {
  const span = hoveredSpan();
  return span?.path === path && t >= span.from && t <= (span.to ?? Infinity);
}

/** Handlers for a row that tells of a state at an instant: hover and focus light its visit up. */
export const hoverHandlers = (/** @type {string} */ path, /** @type {number} */ t) => ({
  onPointerEnter: () => hoverAt(path, t),
  onPointerLeave: () => hover(null),
  onFocusIn: () => hoverAt(path, t),
  onFocusOut: () => hover(null),
});

/** The visit that the pointer is on, with its end. */
export function hoveredSpan() {
  const visit = hovered.value;
  return visit && run.spans.findLast((one) => one.path === visit.path && one.from === visit.from);
}

// -- plots ------------------------------------------------------------------------------------

const PLOTTED_MACHINES = 30; // whose plots are kept in the browser

/** @type {Signal<string[][] | null>} ids of series by plot; null: nobody has chosen any */
export const plotsChosen = signal(null);
/** @type {string[][]} */
let usual = [];
export const plotsShown = computed(() => {
  slowTick.value;
  if (plotsChosen.value) return plotsChosen.value;
  const found = usualPlots(shown(), scene.series.keys());
  const isMore = found.flat().length > usual.flat().length; // none goes while the run goes on
  if (isMore) usual = found;
  return usual;
});

/** Take up the plots of the machine shown. */
export function loadPlots() {
  const kept = saved("plots", {});
  usual = [];
  const mine = own(kept, model.value?.root.label ?? "");
  plotsChosen.value = mine === undefined ? null : knownPlots(mine);
}

/** @param {string[][]} next */
export function setPlots(next) {
  plotsChosen.value = knownPlots(next);
  const isCut = plotsChosen.value.flat().length < next.flat().length;
  if (isCut) notify(`There are ${MOST_PLOTS} plots of ${MOST_LINES} lines at most: remove one first`, "error");
  const name = model.value?.root.label;
  if (name === undefined) return;
  const others = Object.entries(saved("plots", {})).filter(([one]) => one !== name);
  save("plots", Object.fromEntries([...others, [name, plotsChosen.value]].slice(-PLOTTED_MACHINES)));
}

/** @param {number} number of the plot @param {string} id */
export const addLine = (number, id) => setPlots(plotsShown.value.map((ids, i) => (i === number ? [...ids, id] : ids)));

/** @param {number} number of the plot @param {string} id */
export const removeLine = (number, id) =>
  setPlots(plotsShown.value.map((ids, i) => (i === number ? ids.filter((one) => one !== id) : ids)));

// -- panels -----------------------------------------------------------------------------------

/** @type {Signal<import("#core/arrangement.js").Arrangement | null>} null: the usual one */
export const arrangement = signal(arrangementOf(saved("panels", null)));
export const isPhone = signal(false); // whether there is room for one part of the page only
export const part = signal("machine"); // the one that is shown on a phone: machine, map, time or log

/** A phone has its own; and a question is never hidden. */
export const arrangementShown = computed(() => {
  const chosen = isPhone.value ? usualArrangement() : (arrangement.value ?? usualArrangement());
  return asksNow.value && !placeOf(chosen, "details") ? moved(chosen, "details", "right") : chosen;
});

/** Names of the panels that have something to show. */
export const panelsThere = computed(() => {
  const isThere = { map: hasMap.value, plots: plotsShown.value.length > 0 };
  return new Set(PANELS.filter((name) => /** @type {Record<string, boolean>} */ (isThere)[name] ?? true));
});

/** @param {import("#core/arrangement.js").Arrangement | null} next null: the usual one */
export function arrange(next) {
  arrangement.value = next;
  save("panels", next && wordOf(next));
}

// -- notes ------------------------------------------------------------------------------------

const NOTED_RUNS = 30; // so many programs' notes are kept in the browser

/** @type {Signal<import("#core/links.js").Note[]>} */
export const notes = signal([]);
/** @type {Signal<number | null>} */
export const noteAt = signal(null); // instant of the note that is being written [ms]

export function askForNote() {
  if (run.first() !== null) noteAt.value = nowMs();
}

/** @returns {{ epoch: string, notes: import("#core/links.js").Note[] }[]} */
const notedRuns = () => {
  const all = saved("notes", []);
  return Array.isArray(all) ? all : [];
};

/** Take up the notes of the machine shown. */
export function loadNotes() {
  const { notes: kept } = notedRuns().find((one) => one?.epoch === facts.value?.epoch) ?? {};
  notes.value = Array.isArray(kept) ? kept : [];
}

/** @param {import("#core/links.js").Note[]} next */
function setNotes(next) {
  const epoch = facts.value?.epoch;
  notes.value = next;
  if (!epoch) return;
  const others = notedRuns().filter((one) => one?.epoch !== epoch);
  save("notes", [...others, ...(next.length ? [{ epoch, notes: next }] : [])].slice(-NOTED_RUNS));
}

/** @param {import("#core/links.js").Note[]} more */
export const addNotes = (more) => setNotes(withNotes(notes.value, more));

/** @param {import("#core/links.js").Note} note */
export const removeNote = (note) => setNotes(notes.value.filter((one) => one !== note));

// -- clocks -------------------------------------------------------------------------------------

const LAG_WINDOW_MS = 30_000; // a clock that was set is believed after twice that at most

// How far another clock is behind this one [ms], transport included: the least of the newest lags.
class Lag {
  since = performance.now();
  least = Infinity; // since then
  before = Infinity; // in the time before that
  forget() {
    this.since = performance.now();
    this.least = Infinity;
    this.before = Infinity;
  }
  /** @param {number} t time on that clock when it spoke [ms] */
  measure(t) {
    if (performance.now() - this.since > LAG_WINDOW_MS) {
      this.since = performance.now();
      this.before = this.least;
      this.least = Infinity;
    }
    this.least = Math.min(this.least, Date.now() - t);
  }
  get value() {
    const least = Math.min(this.least, this.before);
    return least === Infinity ? null : least;
  }
}
export const robotLag = new Lag();
export const viewerLag = new Lag();

/** The instant shown, on the robot's clock [ms since the epoch]. */
export const nowMs = () => cursor.value ?? liveMs();

/** The newest instant there is, on the robot's clock [ms since the epoch]. */
export function liveMs() {
  const about = facts.value;
  const ended = run.now.ended != null || about?.recorded || about?.stale != null || connection.value === "file";
  const lag = robotLag.value ?? (viewerLag.value ?? 0) + (ms(facts.value?.behind) ?? 0);
  const robot = Date.now() - lag;
  return ended ? (run.last() ?? robot) : Math.max(robot, run.last() ?? 0);
}

/** Whether the picture moves on by itself: it plays, or the run goes on and one looks at now. */
export const goes = computed(() => {
  tick.value;
  const isOver = run.now.ended != null || facts.value?.recorded || facts.value?.stale != null;
  return playing.value !== null || (cursor.value === null && !isOver && connection.value !== "file");
});

/** When the run that is shown began [ms]. */
export const began = () => ms(shown().started) ?? run.first();

/** An instant as time since the run began, such as 00:32.0. @param {number} t [ms] */
export function instantText(t) {
  const seconds = (t - (began() ?? t)) / 1000;
  const tenths = Math.round(Math.abs(seconds) * 10);
  const two = (/** @type {number} */ n) => String(Math.floor(n)).padStart(2, "0");
  const hours = Math.floor(tenths / 36_000);
  const minutes = `${two((tenths % 36_000) / 600)}:${two((tenths % 600) / 10)}.${tenths % 10}`;
  return `${seconds <= -0.05 ? "-" : ""}${hours ? `${hours}:` : ""}${minutes}`;
}

/** Why nothing can be commanded; null when it can. */
export const whyDisarmed = computed(() =>
  cursor.value === null ? null : "You look at the past: back to live first (l)",
);

// -- what follows from it -----------------------------------------------------------------------

export const activePaths = computed(() => {
  tick.value;
  return Object.entries(shown().states)
    .filter(([, state]) => state.since != null)
    .map(([path]) => path);
});
export const activeLeaves = computed(() => {
  const all = activePaths.value;
  return all.filter((path) => !all.some((other) => other.startsWith(`${path}/`)));
});

/** Where a run that has ended has ended: the innermost state that was left last; else what is active. */
export const lastLeaves = computed(() => {
  if (activeLeaves.value.length) return activeLeaves.value;
  const left = Object.entries(shown().states).filter(([, state]) => state.left != null);
  if (!left.length) return [];
  const depth = (/** @type {string} */ path) => path.split("/").length;
  // Its containers were left at the same instant, or moments later.
  const [last] = left.reduce((a, b) => ((b[1].left ?? 0) > (a[1].left ?? 0) ? b : a));
  const isWithin = (/** @type {string} */ path, /** @type {string} */ top) => `${path}/`.startsWith(`${top}/`);
  const inside = left.filter(([path, state]) => isWithin(path, last) && (state.left ?? 0) >= entered(last));
  const end = inside.filter(([path]) => !inside.some(([other]) => other.startsWith(`${path}/`)));
  const newest = end.reduce((a, b) => {
    const later = (b[1].left ?? 0) - (a[1].left ?? 0);
    return later > 0 || (later === 0 && depth(b[0]) > depth(a[0])) ? b : a;
  });
  return [newest[0]];
});

/** When a state was entered last [ns]. @param {string} path */
function entered(path) {
  const span = run.spans.findLast((one) => one.path === path);
  return span ? span.from * 1e6 : 0;
}

export const runStatus = computed(() => {
  tick.value;
  const data = shown();
  const about = facts.value;
  const cutShort = data.ended == null && data.started != null;
  if (!about) return { word: "waiting", kind: "other" };
  if (cursor.value !== null) return { word: "replay", kind: "preempted" };
  if (connection.value === "file" && cutShort) return { word: "recording ends here", kind: "active" };
  if (about.stale != null && data.ended == null) return { word: "stale", kind: "waiting" };
  if (connection.value === "lost") return { word: "reconnecting", kind: "waiting" };
  if (data.ended != null) return { word: `ended: ${data.outcome}`, kind: "done" };
  if (asks(data)) return { word: "asks you", kind: "waiting" };
  if (about.control?.paused) return { word: pausedText(data), kind: "waiting" };
  if (data.states[model.value?.root.path ?? ""]?.preempt) return { word: "preempting", kind: "preempted" };
  if (data.started == null) return { word: "not started", kind: "other" };
  return { word: about.recorded ? "recording ends here" : "running", kind: "active" };
});

/** Whether a state waits for an answer. @param {RunState} data */
const asks = (data) =>
  Object.values(data.states).some(({ since, question }) => since != null && question?.answered === null);

/** Whether the machine waits for an answer now, whatever instant is looked at. */
export const asksNow = computed(() => {
  tick.value;
  return asks(run.now) && !facts.value?.recorded && facts.value?.stale == null;
});

/** What is held back, and why, in words. @param {RunState} data */
function pausedText(data) {
  const held = Object.entries(data.states).filter(([, state]) => state.waits != null);
  if (!held.length) return "paused";
  const [path, state] = held[0];
  const why = state.waits === "pause" ? "" : ` (${state.waits})`;
  return `paused before ${nameOf(path)}${held.length > 1 ? ` and ${held.length - 1} more` : ""}${why}`;
}

/**
 * The name of a state, with that of its container where several have it.
 * @param {string} path
 */
export function nameOf(path) {
  const node = model.value?.get(path);
  if (!node) return shorten(path.slice(path.lastIndexOf("/") + 1));
  return node.isRepeated && node.parent?.parent ? `${node.parent.name} \u203a ${node.name}` : node.name;
}

// Names of the actions that have a server and of those that had one, as JSON, so that equal lists
// are equal; null before the server has looked.
export const serversSeen = computed(() => {
  const { actions: there, gone, known } = actions.value;
  return known ? JSON.stringify([there.map((one) => one.name), gone]) : null;
});

/**
 * Whether a goal seems to wait for a server. One behind a bridge shows no presence, only answers.
 * @param {GoalRun | null | undefined} goal
 */
export function hasNoServer(goal) {
  if (serversSeen.value === null || !goal || goal.ended != null || goal.feedback != null) return false;
  if (connection.value !== "live" || cursor.value !== null) return false;
  if (facts.value?.stale != null || facts.value?.recorded) return false;
  const plain = (/** @type {string} */ name) => name.replace(/^\//, "");
  const name = plain(goal.action);
  const [there, gone] = JSON.parse(serversSeen.value);
  if (there.includes(name)) return false;
  if (gone.includes(name)) return true;
  const answered = (/** @type {GoalRun} */ one) =>
    plain(one.action) === name && (one.feedback != null || one.result != null);
  return !Object.values(run.now.goals).some(answered);
}

// -- the machine, and which of its containers are open ------------------------------------------

const AROUND = 60; // states to open around one of an overview

let autoDepth = 0; // levels opened without the user; 0: the user has chosen

/** @param {MachinePayload} payload */
export function setModel(payload) {
  const next = new Model(payload, implicit.value);
  model.value = next;
  if (payload !== comparison.value?.model) comparison.value = null;
  /** @type {string[]} */
  const known = saved(`open.${next.root.label}`, []).filter(
    (/** @type {string} */ path) => next.get(path)?.children.length,
  );
  autoDepth = known.length ? 0 : next.readableDepth();
  opened.value = autoDepth ? next.toDepth(autoDepth) : new Set(known);
}

/** @param {boolean} on */
export function setImplicit(on) {
  implicit.value = on;
  save("implicit", on);
  if (model.value) model.value = new Model(model.value.payload, on);
}

/** Open one level less, unless the user has chosen; false when there is no less. */
export function openOneLevelLess() {
  if (autoDepth < 2 || !model.value) return false;
  autoDepth -= 1;
  opened.value = model.value.toDepth(autoDepth);
  return true;
}

/** @param {Set<string>} paths */
export function keepOpened(paths) {
  opened.value = paths;
  autoDepth = 0;
}

/** @param {Set<string>} paths */
export function setOpened(paths) {
  keepOpened(paths);
  if (model.value) save(`open.${model.value.root.label}`, [...paths]);
}

/** Open a state's container and what is in it as far as it can be read, and no other. @param {StateNode} node */
export function openAround(node) {
  const top = node.children.length ? node : node.parent;
  if (!model.value || !top) return;
  const below = top.depth + model.value.readableDepth(AROUND, top);
  const inside = model.value.order.filter(
    (one) => one.children.length && one.depth < below && (one === top || one.path.startsWith(`${top.path}/`)),
  );
  follow.value = false;
  setOpened(new Set([...model.value.ancestors(top.path), ...inside].map((one) => one.path)));
}

/** @param {string} path */
export function toggle(path) {
  const next = new Set(opened.value);
  if (!next.delete(path)) next.add(path);
  follow.value = false;
  setOpened(next);
}

/** Open the containers around a state; false when they are open. @param {string} path */
export function reveal(path) {
  const closed = model.value?.ancestors(path).filter((node) => !opened.value.has(node.path)) ?? [];
  if (closed.length) setOpened(new Set([...opened.value, ...closed.map((node) => node.path)]));
  return closed.length > 0;
}

// -- notices ------------------------------------------------------------------------------------

/** @type {ReturnType<typeof setTimeout> | undefined} */
let noticeTimer;
/** @param {string} text @param {"info" | "error"} [kind] */
export function notify(text, kind = "info") {
  notice.value = { text, kind };
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(
    () => {
      notice.value = null;
    },
    kind === "error" ? 8000 : 3000,
  );
}
