// What events add up to, now and at any earlier instant. The same rules as smachpy/run_state.py.
// Times are milliseconds since the epoch here.

export const RAISED = "exception";
const KEYFRAME = 400; // events between two stored states
const ENDED_GOALS = 20;
const NOT_ASKED = { preempt: null, asked: null, serviced: null, abandoned: null };
const SOURCES = { // as in smachpy/events.py
  signal: "signal", shutdown: "the program\u2019s end", operator: "operator", timeout: "timeout of",
  concurrence: "concurrence, after", action: "action", state: "state", test: "test", program: "program",
};

// Who asked for a preempt, in one phrase; null when an older recording does not say.
export function askerText(asked) {
  if (!asked?.source) return null;
  const who = `${SOURCES[asked.source] ?? asked.source} ${asked.by ?? ""}`.trim();
  return asked.why ? `${who}: ${asked.why}` : who;
}

export const emptyState = () => ({
  run: 0, started: null, ended: null, outcome: null, states: {}, goals: {}, userdata: {},
});

const stateOf = (data, path) =>
  (data.states[path] ??= { visits: 0, since: null, outcome: null, outcomes: {}, seconds: 0 });

function enter(data, e) {
  const s = stateOf(data, e.path);
  s.visits += 1;
  Object.assign(s, { since: e.stamp_ns, ...NOT_ASKED, waits: null, error: null, attempt: 1 });
}

function leave(data, e, outcome) {
  const s = stateOf(data, e.path);
  if (s.since != null) s.seconds += (e.stamp_ns - s.since) / 1e9;
  Object.assign(s, { since: null, outcome, ...NOT_ASKED, waits: null, left: e.stamp_ns });
  s.outcomes[outcome] = (s.outcomes[outcome] ?? 0) + 1;
}

const askedIn = (e) => ({ source: e.source, by: e.by, why: e.why, grace: e.grace });
function answer(data, e, fact) {
  const s = stateOf(data, e.path);
  if (s.preempt) s[fact] = e.stamp_ns;
}

const RULES = {
  Started(data, e) {
    data.run += 1;
    Object.assign(data, { started: e.stamp_ns, ended: null, outcome: null });
    for (const s of Object.values(data.states))
      Object.assign(s, { since: null, ...NOT_ASKED, waits: null });
    enter(data, e);
  },
  Finished(data, e) {
    const outcome = e.outcome ?? RAISED;
    leave(data, e, outcome);
    Object.assign(data, { ended: e.stamp_ns, outcome });
  },
  Entered: enter,
  Left: (data, e) => leave(data, e, e.outcome),
  Failed(data, e) {
    leave(data, e, RAISED);
    stateOf(data, e.path).error = e.error;
  },
  PreemptRequested(data, e) {
    const s = stateOf(data, e.path);
    if (s.since == null || s.preempt) return;
    Object.assign(s, { preempt: e.stamp_ns, asked: askedIn(e) });
  },
  PreemptServiced: (data, e) => answer(data, e, "serviced"),
  Abandoned: (data, e) => answer(data, e, "abandoned"),
  Retried: (data, e) => { stateOf(data, e.path).attempt = e.attempt + 1; },
  Iterated: (data, e) => { stateOf(data, e.path).item = e.number; },
  Paused: (data, e) => { stateOf(data, e.path).waits = e.reason; },
  Resumed: (data, e) => { stateOf(data, e.path).waits = null; },
  UserdataWritten(data, e) {
    const cut = e.path.lastIndexOf("/");
    const container = e.path.slice(0, cut) || e.path;
    const id = `${container} ${e.key}`;
    const before = data.userdata[id]?.value;
    data.userdata[id] = {
      key: e.key, value: e.value, writer: e.path, at: e.stamp_ns, container, before,
    };
  },
  GoalSent(data, e) {
    data.goals[e.goal_id] = {
      path: e.path, action: e.action, since: e.stamp_ns, goal: e.goal, feedback: null,
      first_feedback: null, status: "ACTIVE", text: "", result: null, ended: null,
      attempt: stateOf(data, e.path).attempt ?? 1,
    };
    const ended = Object.keys(data.goals).filter((id) => data.goals[id].ended != null);
    for (const id of ended.slice(0, Math.max(0, ended.length - ENDED_GOALS))) delete data.goals[id];
  },
  GoalFeedback(data, e) {
    const g = data.goals[e.goal_id];
    if (!g) return;
    g.feedback = e.feedback;
    g.first_feedback ??= e.feedback;
    if (e.progress) g.progress = e.progress;
  },
  GoalDone(data, e) {
    const g = data.goals[e.goal_id];
    if (g) Object.assign(g, { status: e.status, text: e.text, result: e.result, ended: e.stamp_ns });
  },
};

export function foldOne(data, e) {
  if (e.dropped) data.dropped = (data.dropped ?? 0) + e.dropped; // so many are missing before it
  RULES[e.kind]?.(data, e);
}
export const ms = (ns) => (ns == null ? null : ns / 1e6);

// One machine's run: the newest state, and every earlier one that the events still tell.
export class Run {
  constructor(base, events) {
    this.base = JSON.stringify(base ?? emptyState());
    this.now = JSON.parse(this.base);
    this.events = [];
    this.frames = [];
    this.spans = [];
    this.open = new Map();
    this.preempts = []; // each: from, and a row for every state that was asked
    this.begun = null;
    this.#resume();
    this.push(events);
  }

  push(events) {
    for (const e of events) {
      if (this.events.length % KEYFRAME === 0) this.frames.push(JSON.stringify(this.now));
      this.events.push(e);
      this.#span(e);
      foldOne(this.now, e);
    }
  }

  // Forget the oldest events where more than `limit` are kept; returns how many were forgotten.
  trim(limit) {
    const blocks = Math.floor((this.events.length - limit) / KEYFRAME);
    if (blocks < 1) return 0;
    const gone = blocks * KEYFRAME;
    this.frames.splice(0, blocks);
    this.base = this.frames[0] ?? JSON.stringify(this.now);
    this.events.splice(0, gone);
    const first = this.events.length ? ms(this.events[0].stamp_ns) : Infinity;
    const kept = (span) => (span.to === null ? this.open.get(span.path) === span : span.to >= first);
    this.spans = this.spans.filter(kept);
    this.preempts = this.preempts.filter((one) => one.rows.some(kept));
    this.begun = this.spans.reduce((least, span) => Math.min(least, span.from), first);
    return gone;
  }

  // What the base says is under way: states that run, and the preempt of some of them.
  #resume() {
    const rows = [];
    for (const [path, s] of Object.entries(this.now.states)) {
      if (s.since == null) continue;
      this.#openSpan(path, ms(s.since));
      if (!s.preempt) continue;
      const span = this.open.get(path);
      Object.assign(span, { preempt: ms(s.preempt), asked: s.asked, serviced: ms(s.serviced), abandoned: ms(s.abandoned) });
      rows.push(span);
    }
    rows.sort((a, b) => a.preempt - b.preempt);
    if (rows.length) this.preempts.push({ from: rows[0].preempt, rows });
  }

  #openSpan(path, from) {
    const span = { path, from, to: null, outcome: null, preempt: null, asked: null, serviced: null, abandoned: null };
    this.open.set(path, span);
    this.spans.push(span);
    if (this.begun == null || from < this.begun) this.begun = from;
  }

  #span(e) {
    const t = ms(e.stamp_ns);
    if (e.kind === "Started" || e.kind === "Entered") {
      if (e.kind === "Started") this.open.clear();
      this.#openSpan(e.path, t);
    } else if (e.kind === "Left" || e.kind === "Failed" || e.kind === "Finished") {
      const span = this.open.get(e.path);
      if (!span) return;
      Object.assign(span, { to: t, outcome: e.outcome ?? RAISED });
      this.open.delete(e.path);
    } else if (e.kind === "PreemptRequested") {
      const span = this.open.get(e.path);
      if (!span || span.preempt !== null) return;
      Object.assign(span, { preempt: t, asked: askedIn(e) });
      const last = this.preempts.at(-1);
      if (last?.rows.some((row) => row.to === null && this.open.get(row.path) === row)) last.rows.push(span);
      else this.preempts.push({ from: t, rows: [span] });
    } else if (e.kind === "PreemptServiced" || e.kind === "Abandoned") {
      const span = this.open.get(e.path);
      if (span?.preempt != null) span[e.kind === "Abandoned" ? "abandoned" : "serviced"] = t;
    }
  }

  // The newest preempt that had begun at the instant t [ms], as it was then; null: none.
  preemptAt(t) {
    const found = this.preempts.findLast((one) => one.from <= t);
    if (!found) return null;
    const until = (at) => (at !== null && at <= t ? at : null);
    const rows = found.rows.filter((row) => row.preempt <= t).map((row) => ({
      ...row, to: until(row.to), serviced: until(row.serviced), abandoned: until(row.abandoned),
    }));
    const running = rows.filter((row) => row.to === null);
    const holds = running.filter((row) => !running.some((other) => other.path.startsWith(`${row.path}/`)));
    const to = running.length ? null : Math.max(...rows.map((row) => row.to));
    return { from: found.from, to, rows, holds };
  }

  first() { return this.begun ?? (this.events.length ? ms(this.events[0].stamp_ns) : null); }
  last() { return this.events.length ? ms(this.events.at(-1).stamp_ns) : this.begun; }

  // Number of events until and with the instant t [ms].
  indexAt(t) {
    let low = 0, high = this.events.length;
    while (low < high) {
      const mid = (low + high) >> 1;
      if (ms(this.events[mid].stamp_ns) <= t) low = mid + 1; else high = mid;
    }
    return low;
  }

  // The state after the first `count` events.
  after(count) {
    const frame = Math.min(Math.floor(count / KEYFRAME), this.frames.length - 1);
    if (frame < 0) return JSON.parse(this.base);
    const data = JSON.parse(this.frames[frame]);
    for (let i = frame * KEYFRAME; i < count; i++) foldOne(data, this.events[i]);
    return data;
  }
}
