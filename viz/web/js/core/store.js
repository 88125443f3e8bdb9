// The data of the page and the choices of its user. Panels read signals; the diagram reads `shown()`.
import { batch, computed, signal } from "@preact/signals";
import { arrangementOf, moved, PANELS, placeOf, usual as usualArrangement, wordOf } from "#core/arrangement.js";
import { emptyState, ms, own } from "#core/fold.js";
import { withNotes } from "#core/links.js";
import { innermost } from "#core/lists.js";
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
    return fallback; // a page in a file has no storage
  }
}
/** @param {string} name @param {unknown} value */
export function save(name, value) {
  try {
    localStorage.setItem(`smachpy.${name}`, JSON.stringify(value));
  } catch {
    // a page in a file has no storage
  }
}

// -- data from the server -----------------------------------------------------------------------

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
export const gap = signal(null); // number of events that this page missed
/** @type {Signal<ActionsSeen>} */
export const actions = signal({ actions: [], gone: [], goals: [], known: false });
/** @type {Signal<Comparison | null>} */
export const comparison = signal(null);
/** @type {Signal<string | null>} */
export const failure = signal(null); // why nothing is shown

// -- choices of the user ------------------------------------------------------------------------

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
export const pointed = signal(null); // the instant below the pointer in the timeline or a plot [ms]
/** @type {Signal<Set<string>>} */
export const opened = signal(new Set()); // paths of containers
export const help = signal(false);
/** @type {Signal<boolean>} */
export const sound = signal(saved("sound", true)); // whether a new question makes a sound
/** @type {Signal<string>} */
export const operator = signal(saved("operator", "")); // the name under which answers are given
export const tokenAsked = signal(false); // whether the viewer refused this page's token
/** @type {Signal<Why | null>} */
export const why = signal(null); // the causes of the run's end, while they are shown
/** The ends of states that led to the outcome. */
export const wayShown = computed(() => wayOf(why.value));
export const treeOpen = signal(false); // on small screens, where the tree covers the page
export const overview = signal(false); // whether states are tiles without arrows, because many are open
/** @type {Signal<{ done: number, all: number } | null>} */
export const laidOut = signal(null); // progress of a long layout [states]
/** @type {Signal<string | null>} */
export const dismissed = signal(null); // the previous run whose notice was closed
export const actionsOpen = signal(false);
export const homeOpen = signal(false); // the list of runs
/** @type {Signal<{ runs: RunRow[], folders: string[], journals: { name: string, problem: string }[] }>} */
export const runs = signal({ runs: [], folders: [], journals: [] });
export const fleetOpen = signal(false); // the live runs together
export const simulateOpen = signal(false); // the dialog of simulated runs
/** @type {Signal<{ missions: Record<string, string>, batches: Batch[] }>} */
export const simulations = signal({ missions: {}, batches: [] });
export const runsKnown = signal(false);
export const runsProblem = signal(""); // why the runs cannot be listed
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
const position = signal(null); // number of events up to there: several may have the same instant
export const instant = computed(() => [cursor.value, position.value]);

export let run = new Run(emptyState(), []);
export let scene = new Scene();
export let marks = new Marks(); // targets of jumps
export const hasMap = signal(false); // whether there is anything to show on a map
/** @type {RunState | null} */
let stateAtCursor = null;

/** @type {Signal<number>} */
export const rate = signal(saved("rate", 1)); // of playing
/** @type {Signal<{ t: number, since: number, rate: number } | null>} */
export const playing = signal(null);
/** @type {Signal<import("#core/playback.js").Stretch | null>} */
export const stretch = signal(null); // the selected part of the run [ms]
/** @type {Signal<number | null>} */
export const filmed = signal(null); // progress of a film [%]
export const looping = signal(false); // whether playing repeats the stretch
/** @type {Signal<string | null>} */
export const followedKey = signal(null); // the userdata key whose changes are targets of jumps

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
 * Add new events; drop the oldest if there are more than the server keeps.
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

/** Add records of robot topics. @param {Observed[]} records */
export const addObserved = (records) => scene.addObserved(records);

const SHORTEST_MS = 20; // the shortest stretch that can be selected

/** @param {string} id of a run */
export function togglePin(id) {
  const next = new Set(pins.value);
  if (!next.delete(id)) next.add(id);
  pins.value = next;
  save("pins", [...next]);
}

/** Set the visit that the pointer is on, in the timeline or the map. @param {Visit | null} visit */
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

/** Show the instant t [ms]; null: now. Playing continues from there. @param {number | null} t */
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

/** Show the state after the first `count` events. @param {number} count */
export function seekTo(count) {
  const event = run.events[count - 1];
  playing.value = null;
  if (event) show(event.stamp_ns / 1e6, count);
}

/** Go forward or back by a number of events. @param {number} step */
export function seekEvent(step) {
  const to = Math.max(1, eventsShown() + step);
  if (to >= run.events.length && step > 0) seek(null);
  else seekTo(Math.min(to, run.events.length));
}

/** Pause or play; at the end of a run that is over, play from the beginning. */
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

/** While playing, show the instant that is due, and finally now. @param {number} moment [ms] */
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

/**
 * Select a stretch of the run between two instants [ms]; none if it is too short.
 * @param {number} a @param {number} [b]
 */
export function selectStretch(a, b = a) {
  const inRun = (/** @type {number} */ t) => Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
  const [from, to] = [inRun(Math.min(a, b)), inRun(Math.max(a, b))];
  stretch.value = to - from >= SHORTEST_MS ? { from, to } : null;
  if (!stretch.value) looping.value = false;
}

/** Repeat the selected stretch, otherwise the visit of the selected state, otherwise the whole run. */
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

/** Move the beginning or end of the selected stretch to the instant shown. @param {"from" | "to"} end */
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
 * The number of events up to the next or previous mark; when live, the newest mark counts as the next one.
 * @param {string} name @param {number} step
 */
export const jumpOf = (name, step) =>
  marks.find(name, eventsShown(), step, model.value) ??
  (step > 0 && cursor.value === null ? marks.find(name, run.events.length + 1, -1, model.value) : null);

/** Go to a mark, or notify the user that there is none. @param {string} name of `Marks.find` @param {number} step */
export function jump(name, step) {
  const count = jumpOf(name, step);
  if (count !== null) seekTo(count);
  else notify(`No ${name.replace(/^kind |^key /, "")} ${step > 0 ? "ahead" : "before"}`);
}

/** The number of kept events up to the instant shown. */
export const eventsShown = () => position.value ?? run.events.length;

/** The newest visit of a state that had begun at an instant. @param {string} path @param {number} t [ms] */
const visitAt = (path, t) => run.spans.findLast((one) => one.path === path && one.from <= t) ?? null;

/** Set what the pointer is on: the visit of a state at an instant, or nothing. @param {string | null} path */
export function hoverAt(path, t = nowMs()) {
  const span = path === null ? null : visitAt(path, t);
  hover(span && { path: span.path, from: span.from });
}

/** Whether the pointer is on the visit of a state at an instant [ms]. @param {string} path */
export function isLit(path, /** @type {number} */ t) {
  const span = hoveredSpan();
  return span?.path === path && t >= span.from && t <= (span.to ?? Infinity);
}

/** Handlers for a row about a state at an instant: pointing at it or focusing it highlights the visit. */
export const hoverHandlers = (/** @type {string} */ path, /** @type {number} */ t) => ({
  onPointerEnter: () => hoverAt(path, t),
  onPointerLeave: () => hover(null),
  onFocusIn: () => hoverAt(path, t),
  onFocusOut: () => hover(null),
});

/** The span of the visit that the pointer is on. */
export function hoveredSpan() {
  const visit = hovered.value;
  return visit && run.spans.findLast((one) => one.path === visit.path && one.from === visit.from);
}

// -- plots ------------------------------------------------------------------------------------

const PLOTTED_MACHINES = 30; // machines whose plots are kept in the browser

/** @type {Signal<string[][] | null>} ids of series by plot; null: no choice was made */
export const plotsChosen = signal(null);
/** @type {string[][]} */
let usual = [];
export const plotsShown = computed(() => {
  slowTick.value;
  if (plotsChosen.value) return plotsChosen.value;
  const found = usualPlots(shown(), scene.series.keys());
  const isMore = found.flat().length > usual.flat().length; // a plot never disappears during a run
  if (isMore) usual = found;
  return usual;
});

/** Load the plots of the machine shown. */
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
export const isPhone = signal(false); // whether there is room for only one part of the page
export const part = signal("machine"); // the part that a phone shows: machine, map, time or log

/** The arrangement in use: phones have a fixed one, and the panel with an open question is never hidden. */
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

const NOTED_RUNS = 30; // runs whose notes are kept in the browser

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

/** Load the notes of the machine shown. */
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

const LAG_WINDOW_MS = 30_000; // after a change of the other clock, the lag is right after at most twice this time

// How far another clock is behind this one [ms], transport included. It is the minimum over two windows of time,
// because the message with the shortest delay shows the difference of the clocks best.
class Lag {
  since = performance.now();
  least = Infinity; // in this window
  before = Infinity; // in the previous window
  forget() {
    this.since = performance.now();
    this.least = Infinity;
    this.before = Infinity;
  }
  /** @param {number} t time on that clock when the message was sent [ms] */
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

/** The present, or the end of a run that is over, on the robot's clock [ms since the epoch]. */
export function liveMs() {
  const about = facts.value;
  const ended = run.now.ended != null || about?.recorded || about?.stale != null || connection.value === "file";
  const lag = robotLag.value ?? (viewerLag.value ?? 0) + (ms(facts.value?.behind) ?? 0);
  const robot = Date.now() - lag;
  return ended ? (run.last() ?? robot) : Math.max(robot, run.last() ?? 0);
}

/** Whether the instant shown moves by itself: a run is played, or a running one is shown live. */
export const goes = computed(() => {
  tick.value;
  const isOver = run.now.ended != null || facts.value?.recorded || facts.value?.stale != null;
  return playing.value !== null || (cursor.value === null && !isOver && connection.value !== "file");
});

/** The beginning of the run shown [ms]. */
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

/** Why commands are disabled; null if they are not. */
export const whyDisarmed = computed(() =>
  cursor.value === null ? null : "You look at the past: back to live first (l)",
);

// -- derived values -----------------------------------------------------------------------------

export const activePaths = computed(() => {
  tick.value;
  return Object.entries(shown().states)
    .filter(([, state]) => state.since != null)
    .map(([path]) => path);
});
export const activeLeaves = computed(() => innermost(activePaths.value, (path) => path));

/** The running innermost states; after the end of a run, the innermost state that was left last. */
export const lastLeaves = computed(() => {
  if (activeLeaves.value.length) return activeLeaves.value;
  const left = Object.entries(shown().states).filter(([, state]) => state.left != null);
  if (!left.length) return [];
  const depth = (/** @type {string} */ path) => path.split("/").length;
  // Containers are left after the state inside, so the last one left is a container around it.
  const [last] = left.reduce((a, b) => ((b[1].left ?? 0) > (a[1].left ?? 0) ? b : a));
  const isWithin = (/** @type {string} */ path, /** @type {string} */ top) => `${path}/`.startsWith(`${top}/`);
  const inside = left.filter(([path, state]) => isWithin(path, last) && (state.left ?? 0) >= entered(last));
  const end = innermost(inside, ([path]) => path);
  const newest = end.reduce((a, b) => {
    const later = (b[1].left ?? 0) - (a[1].left ?? 0);
    return later > 0 || (later === 0 && depth(b[0]) > depth(a[0])) ? b : a;
  });
  return [newest[0]];
});

/** The beginning of a state's newest visit [ns]. @param {string} path */
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

/** Whether a question is open. @param {RunState} data */
const asks = (data) =>
  Object.values(data.states).some(({ since, question }) => since != null && question?.answered === null);

/** Whether a question is open now, independent of the instant shown. */
export const asksNow = computed(() => {
  tick.value;
  return asks(run.now) && !facts.value?.recorded && facts.value?.stale == null;
});

/** The paused state and the reason, as text. @param {RunState} data */
function pausedText(data) {
  const held = Object.entries(data.states).filter(([, state]) => state.waits != null);
  if (!held.length) return "paused";
  const [path, state] = held[0];
  const why = state.waits === "pause" ? "" : ` (${state.waits})`;
  return `paused before ${nameOf(path)}${held.length > 1 ? ` and ${held.length - 1} more` : ""}${why}`;
}

/**
 * The name of a state, with that of its container if several states have it.
 * @param {string} path
 */
export function nameOf(path) {
  const node = model.value?.get(path);
  if (!node) return shorten(path.slice(path.lastIndexOf("/") + 1));
  return node.isRepeated && node.parent?.parent ? `${node.parent.name} \u203a ${node.name}` : node.name;
}

// Names of the actions that have a server and of those that had one; null before they are known. As JSON text, so
// that the signal does not change when a new list has the same names.
export const serversSeen = computed(() => {
  const { actions: there, gone, known } = actions.value;
  return known ? JSON.stringify([there.map((one) => one.name), gone]) : null;
});

/**
 * Whether a goal seems to wait for a server. A server behind a bridge has no token and shows only by its answers.
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

// -- the machine and its open containers --------------------------------------------------------

const AROUND = 60; // states to open around a state of an overview

let autoDepth = 0; // levels opened automatically; 0: the user has chosen

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

/** Open one level less, unless the user has chosen; returns false if that is impossible. */
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

/** Open only a state's container, with as many levels inside as are readable. @param {StateNode} node */
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

/** Open the containers around a state; returns false if all are open. @param {string} path */
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
