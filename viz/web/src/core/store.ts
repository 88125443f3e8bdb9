// The data of the page and the choices of its user. Panels read signals; the diagram reads `shown()`.

import type { Signal } from "@preact/signals";
import { batch, computed, signal } from "@preact/signals";
import type { Arrangement } from "#core/arrangement.ts";
import { arrangementOf, PANELS, usual as usualArrangement, wordOf } from "#core/arrangement.ts";
import { emptyState, ms, own } from "#core/fold.ts";
import type { Note } from "#core/links.ts";
import { withNotes } from "#core/links.ts";
import { innermost } from "#core/lists.ts";
import { Model } from "#core/model.ts";
import { outcomeClass } from "#core/outcomes.ts";
import type { PageName } from "#core/pages.ts";
import type { Stretch } from "#core/playback.ts";
import { instantAt, loopedAt, Marks } from "#core/playback.ts";
import { Run } from "#core/run.ts";
import { robotOf, Scene } from "#core/scene.ts";
import { knownPlots, MOST_LINES, MOST_PLOTS, usualPlots } from "#core/series.ts";
import { shorten } from "#core/text.ts";
import type {
  ActionsSeen,
  Batch,
  Comparison,
  GoalRun,
  MachineFacts,
  MachinePayload,
  MachineSummary,
  Observed,
  Problem,
  RunEvent,
  RunRow,
  RunState,
  Settings,
  StateNode,
  Statistics,
  Theme,
  Visit,
  Why,
} from "#core/types.ts";
import { wayOf } from "#core/why.ts";

function saved<T>(name: string, fallback: T): T {
  try {
    return JSON.parse(localStorage.getItem(`smachpy.${name}`) ?? "null") ?? fallback;
  } catch {
    return fallback; // a page in a file has no storage
  }
}
export function save(name: string, value: unknown) {
  try {
    localStorage.setItem(`smachpy.${name}`, JSON.stringify(value));
  } catch {
    // a page in a file has no storage
  }
}

// -- data from the server -----------------------------------------------------------------------

export const connection: Signal<"connecting" | "live" | "lost" | "file"> = signal("connecting");
export const problem = signal(""); // why the server refuses this page a stream
export const settings: Signal<Settings> = signal({ follow: false, control: false, beat: 0, kept: 0, home: false });
export const machines: Signal<MachineSummary[]> = signal([]);
export const facts: Signal<MachineFacts | null> = signal(null); // of the machine shown
export const problems: Signal<Problem[]> = signal([]);
export const model: Signal<Model | null> = signal(null);
export const statistics: Signal<Statistics | null> = signal(null);
export const gap: Signal<number | null> = signal(null); // number of events that this page missed
/** Null before they are known. */
export const actions: Signal<ActionsSeen | null> = signal(null);
export const comparison: Signal<Comparison | null> = signal(null);
export const failure: Signal<string | null> = signal(null); // why nothing is shown

// -- choices of the user ------------------------------------------------------------------------

export const wanted = signal(""); // name of the machine to show
export const selected: Signal<string | null> = signal(null); // path of a state
export const query = signal(""); // of the search
export const follow = signal(false);
export const implicit: Signal<boolean> = signal(saved("implicit", false));
export const numbers = signal("none"); // a key of statistics.MODES
export const theme: Signal<Theme> = signal(saved<Theme>("theme", "system"));
export const hovered: Signal<Visit | null> = signal(null);
/** The instant below the pointer in the timeline or a plot [ms]. */
export const pointed: Signal<number | null> = signal(null);
export const opened: Signal<Set<string>> = signal(new Set()); // paths of containers
export const help = signal(false);
export const paletteOpen = signal(false);
export const shortcuts = signal(saved("shortcuts", true)); // whether single keys do something
export const sound: Signal<boolean> = signal(saved("sound", true)); // whether a new question makes a sound
export const operator: Signal<string> = signal(saved("operator", "")); // the name under which answers are given
export const tokenAsked = signal(false); // whether the viewer refused this page's token
export const why: Signal<Why | null> = signal(null); // the causes of the run's end, while they are shown
/** The ends of states that led to the outcome. */
export const wayShown = computed(() => wayOf(why.value));
export const treeOpen = signal(false); // on small screens, where the tree covers the page
export const overview = signal(false); // whether states are tiles without arrows, because many are open
export const laidOut: Signal<{ done: number; all: number } | null> = signal(null); // progress of a long layout [states]
export const dismissed: Signal<string | null> = signal(null); // the previous run whose notice was closed
export const pageShown: Signal<PageName> = signal("machine"); // the page on view
export const runs: Signal<{ runs: RunRow[]; folders: string[]; journals: { name: string; problem: string }[] }> =
  signal({ runs: [], folders: [], journals: [] });
export const simulateOpen = signal(false); // the dialog of simulated runs
export const simulations: Signal<{ missions: Record<string, string>; batches: Batch[] }> = signal({
  missions: {},
  batches: [],
});
export const runsKnown = signal(false);
export const runsProblem = signal(""); // why the runs cannot be listed
export const pins: Signal<Set<string>> = signal(new Set(saved<string[]>("pins", []))); // ids of runs
export const chosenAction: Signal<string | null> = signal(null);
export const logFilter = signal("all");
export const laneFilter = signal(""); // names of lanes that the timeline shows
export const notice: Signal<{ text: string; kind: "info" | "error" } | null> = signal(null);

// -- the run, now and at an earlier instant -----------------------------------------------------

export const tick = signal(0); // counts the changes that panels should show
export const slowTick = signal(0); // the same, for panels with much text
export const cursor: Signal<number | null> = signal(null); // the instant shown [ms]; null: now
const position: Signal<number | null> = signal(null); // number of events up to there: several may have the same instant
export const instant = computed(() => [cursor.value, position.value]);

export let run = new Run(emptyState(), []);
export let scene = new Scene();
export let marks = new Marks(); // targets of jumps
export const hasMap = signal(false); // whether there is anything to show on a map
let stateAtCursor: RunState | null = null;

export const rate: Signal<number> = signal(saved("rate", 1)); // of playing
export const playing: Signal<{ t: number; since: number; rate: number } | null> = signal(null);
export const stretch: Signal<Stretch | null> = signal(null); // the selected part of the run [ms]
export const filmed: Signal<number | null> = signal(null); // progress of a film [%]
export const looping = signal(false); // whether playing repeats the stretch
export const followedKey: Signal<string | null> = signal(null); // the userdata key whose changes are targets of jumps

export function startRun(base: RunState | null, events: RunEvent[]) {
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

/** Add new events; drop the oldest if there are more than the server keeps. */
export function addEvents(events: RunEvent[]) {
  run.push(events);
  scene.addEvents(events);
  marks.push(events);
  const gone = run.trim(settings.value.kept || Infinity);
  if (gone) marks.forget(gone);
  if (gone && position.value !== null) position.value = Math.max(0, position.value - gone);
}

/** Add records of robot topics. */
export const addObserved = (records: Observed[]) => scene.addObserved(records);

const SHORTEST_MS = 20; // the shortest stretch that can be selected

/** @param id of a run */
export function togglePin(id: string) {
  const next = new Set(pins.value);
  if (!next.delete(id)) next.add(id);
  pins.value = next;
  save("pins", [...next]);
}

/** Set the visit that the pointer is on, in the timeline or the map. */
export function hover(visit: Visit | null) {
  const before = hovered.value;
  if (before?.path !== visit?.path || before?.from !== visit?.from) hovered.value = visit;
}

function show(t: number | null, count: number | null) {
  stateAtCursor = count === null ? null : run.after(count);
  batch(() => {
    cursor.value = t;
    position.value = count;
    tick.value += 1;
    slowTick.value += 1;
  });
}

/** Show the instant t [ms]; null: now. Playing continues from there. */
export function seek(t: number | null) {
  if (t === null) {
    playing.value = null;
    show(null, null);
    return;
  }
  const within = Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
  if (playing.value) playing.value = { t: within, since: performance.now(), rate: rate.value };
  show(within, run.indexAt(within));
}

/** Show the state after the first `count` events. */
export function seekTo(count: number) {
  const event = run.events[count - 1];
  playing.value = null;
  if (event) show(event.stamp_ns / 1e6, count);
}

/** Go forward or back by a number of events. */
export function seekEvent(step: number) {
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

/** While playing, show the instant that is due, and finally now. @param moment [ms] */
export function playOn(moment: number) {
  if (!playing.value) return;
  let t = instantAt(playing.value, moment);
  if (looping.value && stretch.value && t >= stretch.value.to) {
    t = loopedAt(t, stretch.value);
    playing.value = { t, since: moment, rate: rate.value };
  }
  if (t >= (run.last() ?? t)) seek(null);
  else show(t, run.indexAt(t));
}

/** Select a stretch of the run between two instants [ms]; none if it is too short. */
export function selectStretch(a: number, b: number = a) {
  const inRun = (t: number) => Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
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

/** Move the beginning or end of the selected stretch to the instant shown. */
export function moveStretch(end: "from" | "to") {
  const at = nowMs();
  const other = end === "from" ? (stretch.value?.to ?? run.last()) : (stretch.value?.from ?? run.first());
  const isTurned = other !== null && (end === "from" ? at >= other : at <= other);
  if (other === null || isTurned) notify("The selected stretch would end before it begins", "error");
  else selectStretch(at, other);
}

export function setRate(factor: number) {
  rate.value = factor;
  save("rate", factor);
  if (playing.value) seek(cursor.value);
}

/** The number of events up to the next or previous mark; when live, the newest mark counts as the next one. */
export const jumpOf = (name: string, step: number) =>
  marks.find(name, eventsShown(), step, model.value) ??
  (step > 0 && cursor.value === null ? marks.find(name, run.events.length + 1, -1, model.value) : null);

/** Go to a mark, or notify the user that there is none. @param name of `Marks.find` */
export function jump(name: string, step: number) {
  const count = jumpOf(name, step);
  if (count !== null) seekTo(count);
  else notify(`No ${name.replace(/^kind |^key /, "")} ${step > 0 ? "ahead" : "before"}`);
}

/** The number of kept events up to the instant shown. */
export const eventsShown = () => position.value ?? run.events.length;

/** The newest visit of a state that had begun at an instant. @param t [ms] */
const visitAt = (path: string, t: number) => run.spans.findLast((one) => one.path === path && one.from <= t) ?? null;

/** Set what the pointer is on: the visit of a state at an instant, or nothing. */
export function hoverAt(path: string | null, t = nowMs()) {
  const span = path === null ? null : visitAt(path, t);
  hover(span && { path: span.path, from: span.from });
}

/** Whether the pointer is on the visit of a state at an instant [ms]. */
export function isLit(path: string, t: number) {
  const span = hoveredSpan();
  return span?.path === path && t >= span.from && t <= (span.to ?? Infinity);
}

/** Handlers for a row about a state at an instant: pointing at it or focusing it highlights the visit. */
export const hoverHandlers = (path: string, t: number) => ({
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

/** ids of series by plot; null: no choice was made */
export const plotsChosen: Signal<string[][] | null> = signal(null);
let usual: string[][] = [];
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
  const kept = saved<Record<string, unknown>>("plots", {});
  usual = [];
  const mine = own(kept, model.value?.root.label ?? "");
  plotsChosen.value = mine === undefined ? null : knownPlots(mine);
}

export function setPlots(next: string[][]) {
  plotsChosen.value = knownPlots(next);
  const isCut = plotsChosen.value.flat().length < next.flat().length;
  if (isCut) notify(`There are ${MOST_PLOTS} plots of ${MOST_LINES} lines at most: remove one first`, "error");
  const name = model.value?.root.label;
  if (name === undefined) return;
  const others = Object.entries(saved("plots", {})).filter(([one]) => one !== name);
  save("plots", Object.fromEntries([...others, [name, plotsChosen.value]].slice(-PLOTTED_MACHINES)));
}

/** @param number of the plot */
export const addLine = (number: number, id: string) =>
  setPlots(plotsShown.value.map((ids, i) => (i === number ? [...ids, id] : ids)));

/** @param number of the plot */
export const removeLine = (number: number, id: string) =>
  setPlots(plotsShown.value.map((ids, i) => (i === number ? ids.filter((one) => one !== id) : ids)));

// -- panels -----------------------------------------------------------------------------------

/** null: the usual one */
export const arrangement: Signal<Arrangement | null> = signal(arrangementOf(saved<unknown>("panels", null)));
export const isPhone = signal(false); // whether there is room for only one part of the page
export const part = signal("machine"); // the part that a phone shows: machine, map, time or log

/** The arrangement in use; phones have a fixed one. */
export const arrangementShown = computed(() =>
  isPhone.value ? usualArrangement() : (arrangement.value ?? usualArrangement()),
);

/** Names of the panels that have something to show. */
export const panelsThere = computed(() => {
  const isThere = { map: hasMap.value, plots: plotsShown.value.length > 0 };
  return new Set(PANELS.filter((name) => (isThere as Record<string, boolean>)[name] ?? true));
});

/** @param next null: the usual one */
export function arrange(next: Arrangement | null) {
  arrangement.value = next;
  save("panels", next && wordOf(next));
}

// -- notes ------------------------------------------------------------------------------------

const NOTED_RUNS = 30; // runs whose notes are kept in the browser

export const notes: Signal<Note[]> = signal([]);
export const noteAt: Signal<number | null> = signal(null); // instant of the note that is being written [ms]

export function askForNote() {
  if (run.first() !== null) noteAt.value = nowMs();
}

const notedRuns = (): { epoch: string; notes: Note[] }[] => {
  const all = saved<{ epoch: string; notes: Note[] }[]>("notes", []);
  return Array.isArray(all) ? all : [];
};

/** Load the notes of the machine shown. */
export function loadNotes() {
  const { notes: kept } = notedRuns().find((one) => one?.epoch === facts.value?.epoch) ?? {};
  notes.value = Array.isArray(kept) ? kept : [];
}

function setNotes(next: Note[]) {
  const epoch = facts.value?.epoch;
  notes.value = next;
  if (!epoch) return;
  const others = notedRuns().filter((one) => one?.epoch !== epoch);
  save("notes", [...others, ...(next.length ? [{ epoch, notes: next }] : [])].slice(-NOTED_RUNS));
}

export const addNotes = (more: Note[]) => setNotes(withNotes(notes.value, more));

export const removeNote = (note: Note) => setNotes(notes.value.filter((one) => one !== note));

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
  /** @param t time on that clock when the message was sent [ms] */
  measure(t: number) {
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

let lostAt = 0; // when the server was lost, on this clock [ms]
connection.subscribe((state) => {
  if (state === "live") lostAt = 0;
  else if (state === "lost") lostAt ||= Date.now();
});

/**
 * The present, or the end of a run that is over, on the robot's clock [ms since the epoch]. It stands still when the
 * server is lost, and at the last sign of life of a program that is gone.
 */
export function liveMs() {
  const about = facts.value;
  const isOver = run.now.ended != null || about?.recorded || connection.value === "file";
  const behind = ms(about?.behind) ?? 0;
  const lag = robotLag.value ?? (viewerLag.value ?? 0) + behind;
  const robot = about?.stale == null ? (lostAt || Date.now()) - lag : about.stale / 1e6 - behind;
  return isOver ? (run.last() ?? robot) : Math.max(robot, run.last() ?? 0);
}

/** Whether the instant shown moves by itself: a run is played, or a running one is shown live. */
export const goes = computed(() => {
  tick.value;
  const isOver = run.now.ended != null || facts.value?.recorded || facts.value?.stale != null;
  return playing.value !== null || (cursor.value === null && !isOver && connection.value !== "file");
});

/** The beginning of the run shown [ms]. */
export const began = () => ms(shown().started) ?? run.first();

export type ClockName = "run" | "wall" | "relative";
export const CLOCKS: ClockName[] = ["run", "wall", "relative"];
export const clock: Signal<ClockName> = signal(saved<ClockName>("clock", "run")); // by which instants are told

export function setClock(name: ClockName) {
  clock.value = name;
  save("clock", name);
  slowTick.value += 1;
}

/** An instant by the chosen clock: 00:32.0 since the run began, 10:42:59 of the day, or -12.3 s from now. */
export function instantText(t: number, digits: number = 1) {
  if (clock.value === "wall") return wallText(t, digits);
  if (clock.value === "relative") {
    const seconds = (t - liveMs()) / 1000;
    return Math.abs(seconds) < 60 ? `${seconds.toFixed(digits)} s` : runText(t, digits, liveMs());
  }
  return runText(t, digits);
}

function wallText(t: number, digits: number) {
  const unit = 10 ** digits;
  const rounded = new Date(Math.round((t * unit) / 1000) * (1000 / unit));
  const part = digits ? `.${String(Math.round(rounded.getMilliseconds() * (unit / 1000))).padStart(digits, "0")}` : "";
  return `${rounded.toLocaleTimeString("en-GB", { hour12: false })}${part}`;
}

/** An instant as time since another one, by default the beginning of the run, such as 00:32.0. */
export function runText(t: number, digits: number = 1, since = began() ?? t) {
  const seconds = (t - since) / 1000;
  const unit = 10 ** digits; // in a second
  const all = Math.round(Math.abs(seconds) * unit);
  const two = (n: number) => String(Math.floor(n)).padStart(2, "0");
  const hours = Math.floor(all / (3600 * unit));
  const part = digits ? `.${String(all % unit).padStart(digits, "0")}` : "";
  const minutes = `${two((all / unit / 60) % 60)}:${two((all / unit) % 60)}${part}`;
  return `${seconds < 0 && all ? "-" : ""}${hours ? `${hours}:` : ""}${minutes}`;
}

/** Why commands are disabled; null if they are not. */
/** Whether there is nothing to show, nor on its way: no machine runs, or none with the name asked for. */
export const isMissing = computed(() => {
  if (connection.value !== "live" || model.value) return false;
  return !machines.value.length || (wanted.value !== "" && !machines.value.some(({ name }) => name === wanted.value));
});

export const whyDisarmed = computed(() => {
  if (cursor.value !== null) return "You look at the past: back to live first (l)";
  if (connection.value === "lost") return "The viewer's server does not answer";
  return facts.value?.stale == null ? null : "The mission's program does not answer";
});

// -- derived values -----------------------------------------------------------------------------

export const activePaths = computed(() => {
  tick.value;
  return Object.entries(shown().states)
    .filter(([, state]) => state.since != null)
    .map(([path]) => path);
});
export const activeLeaves = computed(() => innermost(activePaths.value, (path) => path));

/** The running innermost states now, independent of the instant shown. */
export function runningLeaves() {
  const paths = Object.keys(run.now.states).filter((path) => run.now.states[path].since != null);
  return innermost(paths, (path) => path);
}

/** The names of the robots that the machine shown drives: the namespaces of its actions, or its own. */
export function robotNames() {
  const names = new Set(Object.values(run.now.goals).map((goal) => robotOf(goal.action)));
  for (const name of scene.robots.keys()) names.add(name);
  names.delete("");
  const own = facts.value?.name.split("/").slice(0, -1).join("/");
  return names.size || !own ? [...names].sort() : [own];
}

/** The running innermost states; after the end of a run, the innermost state that was left last. */
export const lastLeaves = computed(() => {
  if (activeLeaves.value.length) return activeLeaves.value;
  const left = Object.entries(shown().states).filter(([, state]) => state.left != null);
  if (!left.length) return [];
  const depth = (path: string) => path.split("/").length;
  // Containers are left after the state inside, so the last one left is a container around it.
  const [last] = left.reduce((a, b) => ((b[1].left ?? 0) > (a[1].left ?? 0) ? b : a));
  const isWithin = (path: string, top: string) => `${path}/`.startsWith(`${top}/`);
  const inside = left.filter(([path, state]) => isWithin(path, last) && (state.left ?? 0) >= entered(last));
  const end = innermost(inside, ([path]) => path);
  const newest = end.reduce((a, b) => {
    const later = (b[1].left ?? 0) - (a[1].left ?? 0);
    return later > 0 || (later === 0 && depth(b[0]) > depth(a[0])) ? b : a;
  });
  return [newest[0]];
});

/** The beginning of a state's newest visit [ns]. */
function entered(path: string) {
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
  if (data.ended != null) return { word: `ended: ${data.outcome}`, kind: outcomeClass(data.outcome) };
  if (asks(data)) return { word: "asks you", kind: "waiting" };
  if (about.control?.paused) return { word: pausedText(data), kind: "waiting" };
  if (data.states[model.value?.root.path ?? ""]?.preempt) return { word: "preempting", kind: "preempted" };
  if (data.started == null) return { word: "not started", kind: "other" };
  return { word: about.recorded ? "recording ends here" : "running", kind: "active" };
});

/** Whether a question is open. */
const asks = (data: RunState) =>
  Object.values(data.states).some(({ since, question }) => since != null && question?.answered === null);

/** The paused state and the reason, as text. */
function pausedText(data: RunState) {
  const held = Object.entries(data.states).filter(([, state]) => state.waits != null);
  if (!held.length) return "paused";
  const [path, state] = held[0];
  const why = state.waits === "pause" ? "" : ` (${state.waits})`;
  return `paused before ${nameOf(path)}${held.length > 1 ? ` and ${held.length - 1} more` : ""}${why}`;
}

/** The name of a state, with that of its container if several states have it. */
export function nameOf(path: string) {
  const node = model.value?.get(path);
  if (!node) return shorten(path.slice(path.lastIndexOf("/") + 1));
  return node.isRepeated && node.parent?.parent ? `${node.parent.name} \u203a ${node.name}` : node.name;
}

// Names of the actions that have a server and of those that had one; null before they are known. As JSON text, so
// that the signal does not change when a new list has the same names.
export const serversSeen = computed(() => {
  if (!actions.value) return null;
  const { actions: there, gone } = actions.value;
  return JSON.stringify([there.map((one) => one.name), gone]);
});

/** Whether a goal seems to wait for a server. A server behind a bridge has no token and shows only by its answers. */
export function hasNoServer(goal: GoalRun | null | undefined) {
  if (serversSeen.value === null || !goal || goal.ended != null || goal.feedback != null) return false;
  if (connection.value !== "live" || cursor.value !== null) return false;
  if (facts.value?.stale != null || facts.value?.recorded) return false;
  const plain = (name: string) => name.replace(/^\//, "");
  const name = plain(goal.action);
  const [there, gone] = JSON.parse(serversSeen.value);
  if (there.includes(name)) return false;
  if (gone.includes(name)) return true;
  const answered = (one: GoalRun) => plain(one.action) === name && (one.feedback != null || one.result != null);
  return !Object.values(run.now.goals).some(answered);
}

// -- the machine and its open containers --------------------------------------------------------

const AROUND = 60; // states to open around a state of an overview

let autoDepth = 0; // levels opened automatically; 0: the user has chosen

export function setModel(payload: MachinePayload) {
  const next = new Model(payload, implicit.value);
  model.value = next;
  if (payload !== comparison.value?.model) comparison.value = null;
  const known: string[] = saved<string[]>(`open.${next.root.label}`, []).filter(
    (path: string) => next.get(path)?.children.length,
  );
  autoDepth = known.length ? 0 : next.readableDepth();
  opened.value = autoDepth ? next.toDepth(autoDepth) : new Set(known);
}

export function setImplicit(on: boolean) {
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

export function keepOpened(paths: Set<string>) {
  opened.value = paths;
  autoDepth = 0;
}

export function setOpened(paths: Set<string>) {
  keepOpened(paths);
  if (model.value) save(`open.${model.value.root.label}`, [...paths]);
}

/** Open only a state's container, with as many levels inside as are readable. */
export function openAround(node: StateNode) {
  const top = node.children.length ? node : node.parent;
  if (!model.value || !top) return;
  const below = top.depth + model.value.readableDepth(AROUND, top);
  const inside = model.value.order.filter(
    (one) => one.children.length && one.depth < below && (one === top || one.path.startsWith(`${top.path}/`)),
  );
  follow.value = false;
  setOpened(new Set([...model.value.ancestors(top.path), ...inside].map((one) => one.path)));
}

export function toggle(path: string) {
  const next = new Set(opened.value);
  if (!next.delete(path)) next.add(path);
  follow.value = false;
  setOpened(next);
}

/** Open the containers around a state; returns false if all are open. */
export function reveal(path: string) {
  const closed = model.value?.ancestors(path).filter((node) => !opened.value.has(node.path)) ?? [];
  if (closed.length) setOpened(new Set([...opened.value, ...closed.map((node) => node.path)]));
  return closed.length > 0;
}

// -- notices ------------------------------------------------------------------------------------

let noticeTimer: ReturnType<typeof setTimeout> | undefined;
export function notify(text: string, kind: "info" | "error" = "info") {
  notice.value = { text, kind };
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(
    () => {
      notice.value = null;
    },
    kind === "error" ? 8000 : 3000,
  );
}
