// Folds the events of a machine into the state of its run, by the same rules as smachpy's `RunState`;
// tests/data/folds.json has examples for both. Times here are nanoseconds since the epoch.

import type { EventKind, EventOf, RunEvent, RunState, StateRun } from "#core/types.ts";
export const RAISED = "exception"; // in place of the outcome of a state that raised an exception
const CUT_SHORT = "a new run began before it ended"; // text of a LOST goal
const NOT_RECORDED = "its end was not recorded"; // text of a LOST goal
const ENDED_GOALS = 20; // ended goals that are kept
const NO_PREEMPT = { preempt: null, asked: null, serviced: null, abandoned: null };

/** Facts that end with the visit of a state. */
const OF_VISIT: ("note" | "question" | "marking" | "fired" | "held" | "resource")[] = [
  "note",
  "question",
  "marking",
  "fired",
  "held",
  "resource",
];

export const emptyState = (): RunState => ({
  run: 0,
  started: null,
  ended: null,
  outcome: null,
  states: {},
  goals: {},
  userdata: {},
});

export const ms = (ns: number | null | undefined) => (ns == null ? null : ns / 1e6);

/**
 * The value of a key in an object whose keys come from a mission: keys like "constructor" must not find inherited ones.
 */
export const own = <T>(map: Record<string, T> | null | undefined, key: string): T | undefined =>
  map && Object.hasOwn(map, key) ? map[key] : undefined;

/** Set the value of a key from a mission; assigning to "__proto__" would replace the prototype. */
function put<T>(map: Record<string, T>, key: string, value: T): T {
  if (key !== "__proto__") map[key] = value;
  else Object.defineProperty(map, key, { value, writable: true, enumerable: true, configurable: true });
  return value;
}

export const requestOf = ({ source, by, why, grace }: EventOf<"PreemptRequested">) => ({
  source: source ?? null,
  by: by ?? null,
  why: why ?? null,
  grace: grace ?? null,
});

/** Fold one event; kinds without a rule change nothing. */
export function foldOne(data: RunState, e: RunEvent) {
  if (e.dropped) data.dropped = (data.dropped ?? 0) + e.dropped; // events missing before this one
  const rule = own(RULES as Record<string, (data: RunState, e: RunEvent) => void>, e.kind);
  rule?.(data, e);
}

type Rules = { [K in EventKind]?: (data: RunState, e: EventOf<K>) => void };

const RULES: Rules = {
  Started(data, e) {
    data.run += 1;
    Object.assign(data, { started: e.stamp_ns, ended: null, outcome: null });
    delete data.outages;
    // States and goals that an earlier run of this root left open were cut short: no event will end them.
    const below = `${e.path}/`;
    for (const [path, state] of Object.entries(data.states))
      if (path === e.path || path.startsWith(below)) Object.assign(state, { since: null, waits: null, ...NO_PREEMPT });
    for (const goal of Object.values(data.goals))
      if (goal.ended == null && goal.path.startsWith(below))
        Object.assign(goal, { status: "LOST", text: CUT_SHORT, ended: e.stamp_ns });
    enter(data, e);
  },
  Recovered(data, e) {
    if (data.started == null) Object.assign(data, { run: data.run + 1, started: e.began_ns });
    Object.assign(data, {
      ended: null,
      outcome: null,
      outages: e.outages.map((pair) => [...pair]),
    });
    const active = new Map(e.active);
    for (const [path, state] of Object.entries(data.states))
      if (state.since != null && !active.has(path))
        Object.assign(state, { since: null, left: e.stamp_ns, waits: null, ...NO_PREEMPT });
    for (const [path, since] of active) {
      const state = stateOf(data, path);
      // Left after that visit began: it was the end of the process that ended the visit.
      if (state.since == null && (state.left ?? -1) >= since) reopen(state, since);
      else if (state.since == null) Object.assign(state, { visits: state.visits + 1, attempt: 1 });
      Object.assign(state, { since: state.since ?? since, waits: null, error: null, ...NO_PREEMPT });
    }
    for (const goal of Object.values(data.goals))
      if (goal.ended == null && !active.has(goal.path))
        Object.assign(goal, { status: "LOST", text: NOT_RECORDED, ended: e.stamp_ns });
  },
  Finished(data, e) {
    const outcome = e.outcome || RAISED;
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
    const state = stateOf(data, e.path);
    if (state.since == null || state.preempt) return;
    Object.assign(state, { preempt: e.stamp_ns, asked: requestOf(e) });
  },
  PreemptServiced: (data, e) => answerPreempt(data, e, "serviced"),
  Abandoned: (data, e) => answerPreempt(data, e, "abandoned"),
  Retried(data, e) {
    stateOf(data, e.path).attempt = e.attempt + 1;
  },
  Fired(data, e) {
    const state = stateOf(data, e.path);
    Object.assign(state, { marking: [...e.marking], fired: e.transition });
    delete state.held;
  },
  HeldBack(data, e) {
    const held: Record<string, string> = {};
    for (const [i, transition] of e.transitions.entries())
      put(held, transition, e.truths?.[i] || `${e.guards[i]} is false`);
    stateOf(data, e.path).held = held;
  },
  Iterated(data, e) {
    stateOf(data, e.path).item = e.number;
  },
  ResourceUse(data, e) {
    const state = stateOf(data, e.path);
    if (e.status === "free") delete state.resource;
    else state.resource = resourceText(e);
  },
  Noted(data, e) {
    stateOf(data, e.path).note = e.text;
  },
  Paused(data, e) {
    stateOf(data, e.path).waits = e.reason;
  },
  Resumed(data, e) {
    stateOf(data, e.path).waits = null;
  },
  QuestionAsked(data, e) {
    const { text, answers, words, default: otherwise, patience, service, has_picture } = e;
    stateOf(data, e.path).question = {
      ...{ text, answers, words, default: otherwise, patience, service, has_picture },
      ...{ asked: e.stamp_ns, answer: null, by: null, answered: null },
    };
  },
  QuestionAnswered(data, e) {
    const { question } = stateOf(data, e.path);
    if (question) Object.assign(question, { answer: e.answer, by: e.by, answered: e.stamp_ns });
  },
  UserdataWritten(data, e) {
    const container = containerOf(e.path);
    put(data.userdata, `${container} ${e.key}`, {
      key: e.key,
      value: e.value,
      writer: e.path,
      at: e.stamp_ns,
      container,
    });
  },
  GoalSent(data, e) {
    put(data.goals, e.goal_id, {
      path: e.path,
      action: e.action,
      since: e.stamp_ns,
      goal: e.goal,
      feedback: null,
      first_feedback: null,
      status: "ACTIVE",
      text: "",
      result: null,
      ended: null,
      attempt: stateOf(data, e.path).attempt ?? 1,
    });
    // Sorted, because objects of JavaScript have keys that look like numbers first.
    const ended = Object.entries(data.goals).filter(([, goal]) => goal.ended != null);
    ended.sort(([a, one], [b, other]) => one.since - other.since || (a < b ? -1 : 1));
    for (const [id] of ended.slice(0, Math.max(0, ended.length - ENDED_GOALS))) delete data.goals[id];
  },
  GoalFeedback(data, e) {
    const goal = own(data.goals, e.goal_id);
    if (!goal) return;
    goal.feedback = e.feedback;
    goal.first_feedback ??= e.feedback;
    if (e.progress) goal.progress = e.progress;
  },
  GoalDone(data, e) {
    const goal = own(data.goals, e.goal_id);
    if (goal) Object.assign(goal, { status: e.status, text: e.text, result: e.result, ended: e.stamp_ns });
  },
};

export const containerOf = (path: string) => path.slice(0, Math.max(0, path.lastIndexOf("/"))) || path;

/** What a state has of a resource: "waits for base, held by /P/DRIVE". */
export function resourceText({ status, resource, holder }: { status: string; resource: string; holder: string }) {
  const words = own({ waits: "waits for", holds: "holds", refused: "is refused" }, status) ?? "frees";
  return `${words} ${resource}${holder ? `, held by ${holder}` : ""}`;
}

function stateOf(data: RunState, path: string): StateRun {
  const known = own(data.states, path);
  return known ?? put(data.states, path, { visits: 0, since: null, outcome: null, outcomes: {}, seconds: 0 });
}

function enter(data: RunState, e: RunEvent) {
  const state = stateOf(data, e.path);
  state.visits += 1;
  for (const fact of OF_VISIT) delete state[fact];
  Object.assign(state, { since: e.stamp_ns, waits: null, error: null, attempt: 1, ...NO_PREEMPT });
}

function leave(data: RunState, e: RunEvent, outcome: string) {
  const state = stateOf(data, e.path);
  delete state.held;
  delete state.resource;
  if (state.since != null) state.seconds += (e.stamp_ns - state.since) / 1e9;
  Object.assign(state, { since: null, left: e.stamp_ns, outcome, waits: null, ...NO_PREEMPT });
  put(state.outcomes, outcome, (own(state.outcomes, outcome) ?? 0) + 1);
}

/** Undo the last end of a state, as its visit continues. */
function reopen(state: StateRun, since: number) {
  state.seconds = Math.max(0, state.seconds - ((state.left ?? since) - since) / 1e9);
  const { outcome, outcomes } = state;
  if (outcome !== null && outcomes[outcome] > 1) outcomes[outcome] -= 1;
  else if (outcome !== null) delete outcomes[outcome];
  state.outcome = Object.keys(outcomes).at(-1) ?? null;
}

function answerPreempt(data: RunState, e: RunEvent, fact: "serviced" | "abandoned") {
  const state = stateOf(data, e.path);
  if (state.preempt) state[fact] = e.stamp_ns;
}
