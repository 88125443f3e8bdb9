// What the page knows and what its user chose. Panels read signals; the diagram reads `shown()`.
import { batch, signal, computed } from "@preact/signals";
import { Model } from "viewer/model";
import { Run, emptyState, ms } from "viewer/fold";

const saved = (name, fallback) => {
  try { return JSON.parse(localStorage.getItem(`smachpy.${name}`)) ?? fallback; } catch { return fallback; }
};
export const save = (name, value) => {
  try { localStorage.setItem(`smachpy.${name}`, JSON.stringify(value)); } catch { /* a file has no storage */ }
};

const LAGS_MS = 30_000; // a robot's clock that was set is believed after twice that at most

export const connection = signal("connecting"); // connecting, live, lost, file
export const settings = signal({ follow: false, control: false });
export const machines = signal([]);
export const wanted = signal(new URLSearchParams(location.search).get("machine") ?? ""); // by name
export const facts = signal(null);
export const problems = signal([]);
export const model = signal(null);
export const failure = signal(null); // a text that the whole page should know
export const tick = signal(0); // counts the changes that panels should show
export const slowTick = signal(0); // the same, for panels of many words
export const cursor = signal(null); // the instant shown [ms]; null: now
const position = signal(null); // so many events have happened there: several may share an instant
export const place = computed(() => [cursor.value, position.value]);
export const gap = signal(null); // so many events went by this page
export const selected = signal(null);
export const query = signal("");
export const follow = signal(false);
export const implicit = signal(saved("implicit", false));
export const heat = signal("none"); // none, counts, time, failures, compare
export const theme = signal(saved("theme", "system"));
export const opened = signal(new Set());
export const statistics = signal(null);
export const notice = signal(null);
export const help = signal(false);
export const comparison = signal(null); // with another machine: its name, the differences
export const actions = signal({ actions: [], gone: [], goals: [], known: false }); // on the network; goals sent from here
export const actionsOpen = signal(false);
export const picked = signal(null); // name of the action whose form is shown
export const logFilter = signal("all");

export let run = new Run(emptyState(), []);
let past = null; // the state at the cursor
let autoDepth = 0; // levels opened by themselves; 0: somebody has chosen what is open

export function begin(base, events) {
  run = new Run(base, events);
  past = null;
  batch(() => { cursor.value = null; position.value = null; gap.value = null; });
}

export const shown = () => (cursor.value === null ? run.now : past ?? run.now);
export const nowMs = () => {
  if (cursor.value !== null) return cursor.value;
  const ended = run.now.ended != null || facts.value?.stale != null || connection.value === "file";
  const robot = Date.now() - behind();
  return ended ? run.last() ?? robot : Math.max(robot, run.last() ?? 0);
};

// How far another clock is behind this one [ms], ways included: the least of the newest lags.
class Lag {
  forget() { this.since = performance.now(); this.least = this.before = Infinity; }
  hear(t) {
    if (performance.now() - this.since > LAGS_MS) { this.since = performance.now(); this.before = this.least; this.least = Infinity; }
    this.least = Math.min(this.least, Date.now() - t);
  }
  get value() { const least = Math.min(this.least, this.before); return least === Infinity ? null : least; }
}
export const robotLag = new Lag(), viewerLag = new Lag();
robotLag.forget();
viewerLag.forget();

// Of the robot: as its events tell, else as its viewer knows.
const behind = () => robotLag.value ?? (viewerLag.value ?? 0) + (ms(facts.value?.behind) ?? 0);

// So many of the kept events have happened by what is shown.
export const happened = () => position.value ?? run.events.length;

function show(t, count) {
  if (count !== null) past = run.after(count);
  batch(() => {
    cursor.value = t;
    position.value = count;
    tick.value += 1;
    slowTick.value += 1;
  });
}

// Take new events in; the oldest are forgotten when there are more than the server keeps.
export function take(events) {
  run.push(events);
  const gone = run.trim(settings.value.kept ?? Infinity);
  if (gone && position.value !== null) position.value = Math.max(0, position.value - gone);
}

// Show the instant t [ms]; null: now.
export function seek(t) {
  if (t === null) { show(null, null); return; }
  t = Math.max(run.first() ?? t, Math.min(t, run.last() ?? t));
  show(t, run.indexAt(t));
}

// Show what the first `count` events add up to.
export function seekTo(count) {
  const event = run.events[count - 1];
  if (event) show(ms(event.stamp_ns), count);
}

export function seekEvent(step) {
  const to = Math.max(1, happened() + step);
  if (to >= run.events.length && step > 0) seek(null);
  else seekTo(Math.min(to, run.events.length));
}

// Names of the actions that have a server and of those that had one, as one text; null when nobody has looked.
export const served = computed(() => {
  const { actions: there, gone, known } = actions.value;
  return known ? JSON.stringify([there.map((one) => one.name), gone]) : null;
});

// Whether a goal seems to wait for a server. One behind a bridge shows no token, only what it answers.
export function unserved(goal) {
  if (served.value === null || !goal || goal.ended != null || goal.feedback != null) return false;
  if (connection.value !== "live" || cursor.value !== null || facts.value?.stale != null || facts.value?.recorded) return false;
  const plain = (name) => name.replace(/^\//, "");
  const name = plain(goal.action), [there, gone] = JSON.parse(served.value);
  if (there.includes(name)) return false;
  const answered = (one) => plain(one.action) === name && (one.feedback != null || one.result != null);
  return gone.includes(name) || !Object.values(run.now.goals).some(answered);
}

export const isActive = (state) => state?.since != null;
export const activePaths = computed(() => {
  tick.value;
  const states = shown().states;
  return Object.keys(states).filter((path) => states[path].since != null);
});
export const activeLeaves = computed(() => {
  const all = activePaths.value;
  return all.filter((p) => !all.some((other) => other.startsWith(p + "/")));
});
export const runStatus = computed(() => {
  tick.value;
  const data = shown(), about = facts.value;
  if (!about) return { word: "waiting", kind: "other" };
  if (cursor.value !== null) return { word: "replay", kind: "preempted" };
  if (connection.value === "file" && data.ended == null && data.started != null) return { word: "recording ends here", kind: "active" };
  if (about.stale != null && data.ended == null) return { word: "stale", kind: "waiting" };
  if (connection.value === "lost") return { word: "reconnecting", kind: "waiting" };
  if (data.ended != null) return { word: `ended: ${data.outcome}`, kind: "done" };
  if (about.control?.paused) return { word: "paused", kind: "waiting" };
  if (data.states[model.value?.root.path]?.preempt) return { word: "preempting", kind: "preempted" };
  if (data.started == null) return { word: "not started", kind: "other" };
  return { word: about.recorded ? "recording ends here" : "running", kind: "active" };
});

export function setModel(payload) {
  const next = new Model(payload, implicit.value);
  next.payload = payload;
  model.value = next;
  if (payload !== comparison.value?.model) comparison.value = null;
  const open = saved(`open.${next.root.label}`, null);
  const known = open?.filter((path) => next.get(path)?.children.length);
  autoDepth = known?.length ? 0 : next.readableDepth();
  opened.value = autoDepth ? next.toDepth(autoDepth) : new Set(known);
}

export function setImplicit(on) {
  implicit.value = on;
  save("implicit", on);
  const payload = model.value?.payload;
  if (!payload) return;
  const next = new Model(payload, on);
  next.payload = payload;
  model.value = next;
}

// One level less, if nobody has chosen what is open; false when there is no less.
export function shallower() {
  if (autoDepth < 2) return false;
  autoDepth -= 1;
  opened.value = model.value.toDepth(autoDepth);
  return true;
}

export function keepOpened(paths) {
  opened.value = paths;
  autoDepth = 0;
}

export function setOpened(paths) {
  keepOpened(paths);
  if (model.value) save(`open.${model.value.root.label}`, [...paths]);
}

export function toggle(path) {
  const next = new Set(opened.value);
  if (!next.delete(path)) next.add(path);
  follow.value = false;
  setOpened(next);
}

// Open what hides a state.
export function reveal(path) {
  const hidden = model.value?.ancestors(path).filter((n) => !opened.value.has(n.path)) ?? [];
  if (hidden.length) setOpened(new Set([...opened.value, ...hidden.map((n) => n.path)]));
  return hidden.length > 0;
}

export function applyTheme() {
  if (theme.value === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme.value;
  save("theme", theme.value);
}

const darkSystem = matchMedia("(prefers-color-scheme: dark)");
export const isDark = () => (theme.value === "system" ? darkSystem.matches : theme.value === "dark");

let noticeTimer = 0;
export function say(text, kind = "info") {
  notice.value = { text, kind };
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => { notice.value = null; }, kind === "error" ? 8000 : 3000);
}
