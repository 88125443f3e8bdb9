// What events add up to, now and at any earlier instant. The same rules as smachpy/run_state.py.
// Times are milliseconds since the epoch here.

export const RAISED = "exception";
const KEYFRAME = 400; // events between two stored states
const ENDED_GOALS = 20;

export const emptyState = () => ({
  run: 0, started: null, ended: null, outcome: null, states: {}, goals: {}, userdata: {},
});

const stateOf = (data, path) =>
  (data.states[path] ??= { visits: 0, since: null, outcome: null, outcomes: {}, seconds: 0 });

function enter(data, e) {
  const s = stateOf(data, e.path);
  s.visits += 1;
  Object.assign(s, { since: e.stamp_ns, preempt: null, waits: null, error: null, attempt: 1 });
}

function leave(data, e, outcome) {
  const s = stateOf(data, e.path);
  if (s.since != null) s.seconds += (e.stamp_ns - s.since) / 1e9;
  Object.assign(s, { since: null, outcome, preempt: null, waits: null, left: e.stamp_ns });
  s.outcomes[outcome] = (s.outcomes[outcome] ?? 0) + 1;
}

const RULES = {
  Started(data, e) {
    data.run += 1;
    Object.assign(data, { started: e.stamp_ns, ended: null, outcome: null });
    for (const s of Object.values(data.states))
      Object.assign(s, { since: null, preempt: null, waits: null });
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
    if (s.since != null && !s.preempt) s.preempt = e.stamp_ns;
  },
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

export const foldOne = (data, e) => RULES[e.kind]?.(data, e);
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
    this.marks = [];
    this.begun = null;
    for (const [path, s] of Object.entries(this.now.states))
      if (s.since != null) this.#openSpan(path, ms(s.since));
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

  #openSpan(path, from) {
    const span = { path, from, to: null, outcome: null, preempt: null };
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
      if (span) span.preempt ??= t;
    } else if (e.kind === "Abandoned" || e.kind === "Jumped" || e.kind === "OutcomeForced") {
      this.marks.push({ t, path: e.path, kind: e.kind });
    }
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
