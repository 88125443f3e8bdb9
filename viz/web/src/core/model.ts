// The machine as the page draws it: an index over the structure that the server sends.

import { shorten } from "#core/text.ts";
import type { Join, Link, MachinePayload, StateNode } from "#core/types.ts";

// Signs before the names of states that differ between two versions.
export const CHANGE_SIGNS: Record<string, string> = {
  added: "+",
  removed: "\u2212",
  changed: "\u2260",
  numbers: "\u00d7",
};

export const signed = (change: string | undefined, name: string) => (change ? `${CHANGE_SIGNS[change]} ${name}` : name);

export const KIND_NAMES: Record<string, string> = {
  state: "state",
  callback: "function",
  action: "action",
  service: "service call",
  monitor: "monitor",
  condition: "condition",
  machine: "state machine",
  sequence: "sequence",
  concurrence: "concurrence",
  iterator: "iterator",
  plan: "Petri net plan",
  place: "place",
  "goal place": "goal",
  "fail place": "failed plan",
  transition: "transition",
  missing: "missing state",
};

/** Whether a box is a place or a transition of a plan instead of a state. */
export const isPartOfNet = ({ kind }: StateNode) => kind === "transition" || kind.endsWith("place");

/** Whether a state runs at every end of what it is in. */
const isCleanup = (node: StateNode) => node.details.some(([name, value]) => name === "runs" && value === "at any end");

/** Whether a state is a clean-up, or in one. */
export function isInCleanup(node: StateNode | null | undefined): boolean {
  return Boolean(node && (isCleanup(node) || isInCleanup(node.parent)));
}

const MANY = 7; // branches of a concurrence from which they are cards, and stay closed
const READABLE = 40; // boxes that are readable at a glance

export class Model {
  payload: MachinePayload;
  keys: MachinePayload["keys"];
  root: StateNode;
  byPath: Map<string, StateNode> = new Map();
  order: StateNode[] = []; // parents first

  /** @param implicit whether to show implicit transitions */
  constructor(payload: MachinePayload, implicit: boolean) {
    this.payload = payload;
    this.keys = payload.keys;
    this.root = implicit ? payload.implicit : payload.explicit;
    this.#index(this.root, null, 0);
    const counts = new Map();
    for (const { name } of this.order) counts.set(name, (counts.get(name) ?? 0) + 1);
    for (const node of this.order) node.isRepeated = counts.get(node.name) > 1;
  }

  #index(node: StateNode, parent: StateNode | null, depth: number) {
    Object.assign(node, { parent, depth, number: this.order.length });
    node.name = shorten(node.caption || node.label);
    node.shown = signed(node.change, node.name);
    this.byPath.set(node.path, node);
    this.order.push(node);
    node.total = 1;
    for (const child of node.children) {
      this.#index(child, node, depth + 1);
      node.total += child.total;
    }
    node.joins = joinsOf(node);
    node.links = linksOf(node);
    const wired = new Map();
    for (const link of node.links)
      for (const outcome of link.outcomes) wired.set(link.source, (wired.get(link.source) ?? new Set()).add(outcome));
    for (const child of node.children) child.wired = child.outcomes.filter((o) => wired.get(child.label)?.has(o));
  }

  get(path: string | null | undefined) {
    return path == null ? undefined : this.byPath.get(path);
  }

  /** The containers around a state, outermost first. */
  ancestors(path: string) {
    const found = [];
    for (let node = this.get(path)?.parent; node; node = node.parent) found.unshift(node);
    return found;
  }

  /** The arrow of an outcome of a state. */
  linkOf(node: StateNode, outcome: string) {
    return node.parent?.links.find((link) => link.source === node.label && link.outcomes.includes(outcome));
  }

  search(text: string) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    if (!words.length) return [];
    const found = this.order.filter((node) => words.every((word) => node.path.toLowerCase().includes(word)));
    const rank = (node: StateNode) => (node.label.toLowerCase().startsWith(words[0]) ? 0 : 1);
    return found.sort((a, b) => rank(a) - rank(b) || a.number - b.number);
  }

  /** Paths of the containers down to `depth` levels, or of all; up to there many branches of one stay closed. */
  toDepth(depth: number) {
    const isWanted = (node: StateNode) =>
      node.children.length > 0 && node.depth < depth && (depth >= ALL_LEVELS || !this.isBranch(node));
    return new Set(this.order.filter(isWanted).map((node) => node.path));
  }

  /** Whether a state is one of many branches, or within one. */
  isBranch(node: StateNode) {
    for (let one = node; one.parent; one = one.parent) if (hasManyBranches(one.parent)) return true;
    return false;
  }

  /** The greatest depth at which a page is readable at a glance. */
  readableDepth(most = READABLE, from = this.root) {
    let visible = 0;
    let depth = 0;
    let level = [from];
    while (level.length) {
      visible += level.length;
      if (visible > most && depth > 1) break;
      depth += 1;
      level = level.flatMap((node) => (hasManyBranches(node) ? [] : node.children));
    }
    return Math.max(depth - 1, 1);
  }
}

export const ALL_LEVELS = 99;

/** Whether the branches of a concurrence are so many that they are drawn as cards. */
export const hasManyBranches = ({ kind, children }: StateNode) => kind === "concurrence" && children.length >= MANY;

/**
 * The rules of a container with conditions on several children; each is drawn as a bar.
 * The same choice as the static picture's (smachpy_viz.pictures.shapes).
 */
function joinsOf(node: StateNode): Join[] {
  const labels = new Set(node.children.map((child) => child.label));
  return node.rules.flatMap(({ outcome, conditions, text, change }) => {
    const known = conditions.filter(([label]) => labels.has(label));
    if (new Set(known.map(([label]) => label)).size < 2 || text.startsWith("any of")) return [];
    const quorum = /^(\d+) of /.exec(text);
    return [{ outcome, text, change, conditions: known, need: quorum ? Number(quorum[1]) : known.length }];
  });
}

/** The text at a join: how many conditions it needs and, while it waits, how many are met. */
export function joinText({ need, conditions }: Join, met: number) {
  const all = conditions.length;
  const what = need < all ? `${need} of ${all}` : all === 2 ? "both" : `all ${all}`;
  return met > 0 && met < need ? `${what}: ${met} of ${need}` : what;
}

/** The arrows of a container: its transitions, and those of its rules. */
function linksOf(node: StateNode): Link[] {
  const found: Link[] = node.edges.map((edge) => ({ ...edge, rule: null, join: null }));
  const keyOf = (...parts: (string | number | null)[]) => parts.join("\n");
  const known = new Set(found.flatMap((edge) => edge.outcomes.map((o) => keyOf(edge.source, o, edge.target, null))));
  for (const rule of node.rules) {
    const number = node.joins.findIndex((one) => one.outcome === rule.outcome && one.text === rule.text);
    const join = number < 0 ? null : number;
    for (const [source, outcome] of rule.conditions) {
      const key = keyOf(source, outcome, rule.outcome, join);
      if (known.has(key) || !node.children.some((child) => child.label === source)) continue;
      known.add(key);
      const same = found.find(
        (edge) =>
          edge.rule &&
          edge.source === source &&
          edge.target === rule.outcome &&
          edge.change === rule.change &&
          edge.join === join,
      );
      if (same) same.outcomes = [...same.outcomes, outcome];
      else
        found.push({
          source,
          target: rule.outcome,
          to_outcome: true,
          outcomes: [outcome],
          implicit: false,
          back: false,
          rule: rule.text || rule.outcome,
          join,
          change: rule.change,
          note: "",
        });
    }
  }
  return found;
}
