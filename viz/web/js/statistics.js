// Numbers on the graph: of the run shown, of recorded runs, or how they differ.
import * as store from "viewer/store";
import { outcomeClass } from "viewer/model";

export const MODES = [
  ["none", "No numbers"], ["counts", "Counts of this run"], ["time", "Time in this run"],
  ["runs", "Recorded runs"], ["failures", "Failures in recorded runs"], ["compare", "This run against recorded ones"],
];

const total = (outcomes) => Object.values(outcomes ?? {}).reduce((a, b) => a + b, 0);
const share = (outcomes, outcome) => {
  const all = total(outcomes);
  return all ? (outcomes[outcome] ?? 0) / all : 0;
};

// What `Diagram.heat` needs for the chosen mode: [weigh, tone], or [null, null].
export function weights(mode) {
  const own = store.shown().states;
  const recorded = store.statistics.value?.states ?? {};
  const count = (states) => (path, outcome) => {
    const outcomes = states[path]?.outcomes;
    return outcomes?.[outcome] ? { count: outcomes[outcome], share: share(outcomes, outcome) } : null;
  };
  if (mode === "counts") return [count(own), null];
  if (mode === "time") {
    const leaves = Object.entries(own).map(([path, s]) => [path, s.seconds]);
    const most = Math.max(0.001, ...leaves.filter(([p]) => !store.model.value?.get(p)?.children.length).map(([, s]) => s));
    return [count(own), (path) => Math.min(1, (own[path]?.seconds ?? 0) / most)];
  }
  if (mode === "runs") return [count(recorded), null];
  if (mode === "failures") return [count(recorded), (path) => recorded[path]?.failures ?? 0];
  if (mode === "compare") {
    return [count(own), (path) => {
      const a = own[path], b = recorded[path];
      if (!a?.visits || !b?.median) return 0;
      return Math.min(1, Math.max(0, a.seconds / a.visits / b.median - 1));
    }];
  }
  return [null, null];
}

export function coverage() {
  const model = store.model.value, states = store.shown().states;
  if (!model) return { taken: 0, all: 0 };
  let taken = 0, all = 0;
  for (const node of model.order)
    for (const edge of node.edges) {
      if (edge.implicit) continue;
      for (const outcome of edge.outcomes) {
        all += 1;
        if (states[`${node.path}/${edge.source}`]?.outcomes?.[outcome]) taken += 1;
      }
    }
  return { taken, all };
}

export function failureShare(outcomes) {
  const all = total(outcomes);
  const bad = Object.entries(outcomes ?? {}).reduce((n, [o, c]) => n + (outcomeClass(o) === "failure" ? c : 0), 0);
  return all ? bad / all : 0;
}
