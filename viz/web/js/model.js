// The machine as the page draws it: an index over the model that the server extracted.

const SUCCESS = new Set(["succeeded", "success", "done", "ok", "yes", "true", "valid", "complete",
  "completed", "finished", "reached", "arrived"]);
const FAILURE = new Set(["aborted", "failed", "failure", "fail", "error", "invalid", "no", "false",
  "timeout", "timed_out", "lost", "rejected", "unreachable", "exception"]);
const PREEMPTED = ["preempt", "cancel", "recall", "interrupt"];

export function outcomeClass(outcome) {
  const word = String(outcome).toLowerCase();
  if (SUCCESS.has(word)) return "success";
  if (FAILURE.has(word)) return "failure";
  return PREEMPTED.some((w) => word.startsWith(w)) ? "preempted" : "other";
}

export const classOfAll = (outcomes) => {
  const kinds = new Set(outcomes.map(outcomeClass));
  return kinds.size === 1 ? [...kinds][0] : "other";
};

export function shorten(text, length = 34) {
  const line = String(text).slice(0, 4 * length).replace(/\s+/g, " ").replace(/[\p{C}]/gu, "\ufffd");
  return line.length <= length ? line : line.slice(0, length - 1) + "\u2026";
}

// What stands before the name of what has changed between two versions.
export const SIGNS = { added: "+", removed: "\u2212", changed: "\u2260", numbers: "\u00d7" };
export const signed = (change, name) => (change ? `${SIGNS[change]} ${name}` : name);

export const CONTAINERS = new Set(["machine", "sequence", "concurrence", "iterator"]);
export const KIND_NAMES = {
  state: "state", callback: "function", action: "action", service: "service call",
  monitor: "monitor", condition: "condition", machine: "state machine", sequence: "sequence",
  concurrence: "concurrence", iterator: "iterator", missing: "missing state",
};

export class Model {
  constructor(payload, implicit) {
    this.keys = payload.keys;
    this.implicit = implicit;
    this.root = implicit ? payload.implicit : payload.explicit;
    this.byPath = new Map();
    this.order = [];
    this.#index(this.root, null, 0);
  }

  #index(node, parent, depth) {
    Object.assign(node, { parent, depth, number: this.order.length });
    node.name = shorten(node.label);
    node.shown = signed(node.change, node.name);
    this.byPath.set(node.path, node);
    this.order.push(node);
    node.total = 1;
    for (const child of node.children) {
      this.#index(child, node, depth + 1);
      node.total += child.total;
    }
    node.links = links(node);
    const wired = new Map();
    for (const link of node.links)
      for (const outcome of link.outcomes)
        wired.set(link.source, (wired.get(link.source) ?? new Set()).add(outcome));
    for (const child of node.children)
      child.wired = child.outcomes.filter((o) => wired.get(child.label)?.has(o));
  }

  get(path) { return this.byPath.get(path); }
  ancestors(path) {
    const found = [];
    for (let n = this.get(path)?.parent; n; n = n.parent) found.unshift(n);
    return found;
  }
  search(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    if (!words.length) return [];
    const hit = (n) => words.every((w) => n.path.toLowerCase().includes(w));
    const near = (n) => (n.label.toLowerCase().startsWith(words[0]) ? 0 : 1);
    return this.order.filter(hit).sort((a, b) => near(a) - near(b) || a.number - b.number);
  }
  // Containers down to `depth` levels.
  toDepth(depth) {
    return new Set(this.order.filter((n) => n.children.length && n.depth < depth).map((n) => n.path));
  }
  // The greatest depth at which a page is readable at a glance.
  readableDepth(most = 40) {
    let visible = 0, depth = 0, level = [this.root];
    while (level.length) {
      visible += level.length;
      if (visible > most && depth > 1) break;
      depth += 1;
      level = level.flatMap((n) => n.children);
    }
    return Math.max(depth - 1, 1);
  }
}

// The arrows of a container: its transitions, and what its rules make of its children's outcomes.
function links(node) {
  const found = node.edges.map((e) => ({ ...e, rule: null }));
  const have = new Set(found.flatMap((e) => e.outcomes.map((o) => `${e.source}\n${o}\n${e.target}`)));
  for (const rule of node.rules)
    for (const [source, outcome] of rule.conditions) {
      const key = `${source}\n${outcome}\n${rule.outcome}`;
      if (have.has(key) || !node.children.some((c) => c.label === source)) continue;
      have.add(key);
      const same = found.find((e) => e.rule && e.source === source && e.target === rule.outcome && e.change === rule.change);
      if (same) same.outcomes = [...same.outcomes, outcome];
      else found.push({ source, target: rule.outcome, to_outcome: true, outcomes: [outcome],
        implicit: false, back: false, rule: rule.text || rule.outcome, change: rule.change, note: "" });
    }
  return found;
}
