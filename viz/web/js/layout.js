// Where things are: one ELK graph per open container, bottom-up, in a worker, and cached.
// Opening or closing a container lays out itself and its ancestors only.
import { measure } from "viewer/measure";

const SEP = "\u0001";
const ROW = 14, LEAF_H = 26, PILL_H = 15, ENTRY = 10;
const FLOW = {
  DOWN: { out: "SOUTH", in: "NORTH" },
  RIGHT: { out: "EAST", in: "WEST" },
};
const SPACING = {
  "elk.spacing.nodeNode": "18", "elk.spacing.edgeNode": "11", "elk.spacing.edgeEdge": "9",
  "elk.layered.spacing.edgeNodeBetweenLayers": "11",
  "elk.layered.spacing.edgeEdgeBetweenLayers": "9",
  "elk.spacing.edgeLabel": "3", "elk.spacing.portPort": "10", "elk.spacing.componentComponent": "22",
};

class Elk {
  constructor(worker) {
    this.worker = worker;
    this.calls = new Map();
    this.count = 0;
    worker.onmessage = ({ data }) => {
      const call = this.calls.get(data.id);
      this.calls.delete(data.id);
      if (!call) return;
      if (data.error) call.fail(new Error(data.error.message ?? String(data.error)));
      else call.done(data.data);
    };
    this.#ask({ cmd: "register", algorithms: ["layered"] });
  }
  layout(graph) { return this.#ask({ cmd: "layout", graph, layoutOptions: {}, options: {} }); }
  #ask(message) {
    const id = this.count++;
    return new Promise((done, fail) => {
      this.calls.set(id, { done, fail });
      this.worker.postMessage({ id, ...message });
    });
  }
}

export const pillWidth = (outcome) => measure(outcome, 9, true) + 15;
export function leafWidth(node) {
  const closed = node.children.length ? 20 + measure(String(node.total - 1), 9) : 0;
  return Math.max(56, 44 + measure(node.shown, 11, true) + closed);
}

export class Layout {
  constructor(worker) {
    this.elk = new Elk(worker);
    this.cache = new Map();
    this.chosen = new Map(); // container path -> direction, kept so that nothing jumps about
    this.calls = 0;
  }

  clear() { this.forget(); this.chosen.clear(); }
  forget() { this.cache.clear(); } // but keep the directions

  // Lay out everything below `root`, with the containers of `open` opened.
  async run(root, open) {
    const levels = [];
    const height = (node) => {
      if (!this.#isOpen(node, open)) return -1;
      const h = 1 + Math.max(-1, ...node.children.map(height));
      (levels[h] ??= []).push(node);
      return h;
    };
    if (height(root) < 0) return null;
    const keys = new Map();
    for (const level of levels) for (const node of level) keys.set(node, this.#key(node, open, keys));
    for (const level of levels) await this.#layLevel(level, root, open, keys);
    return this.#best(root, null, keys);
  }

  #isOpen(node, open) { return node.children.length > 0 && open.has(node.path); }

  #key(node, open, keys) {
    const inner = node.children.filter((c) => this.#isOpen(c, open)).map((c) => keys.get(c));
    return `${node.path}(${inner.join(SEP)})`;
  }

  #directions(node) {
    const chosen = this.chosen.get(node.path);
    return chosen ? [chosen] : ["DOWN", "RIGHT"];
  }

  async #layLevel(level, root, open, keys) {
    const wanted = [];
    for (const node of level)
      for (const outer of node === root ? [null] : ["DOWN", "RIGHT"])
        for (const dir of this.#directions(node)) {
          const key = keys.get(node) + SEP + dir + SEP + outer;
          if (!this.cache.has(key)) wanted.push({ key, node, dir, outer });
        }
    if (!wanted.length) return;
    this.calls += 1;
    wanted.forEach((w, i) => { w.plan = this.#plan(w.node, open, keys, w.dir, w.outer, `g${i}`); });
    const graph = {
      id: "batch",
      layoutOptions: { "elk.algorithm": "fixed" },
      children: wanted.map((w) => w.plan.graph),
      edges: [],
    };
    const result = await this.elk.layout(graph);
    wanted.forEach((w, i) => this.cache.set(w.key, finish(w, result.children[i])));
  }

  #best(node, outer, keys) {
    let best = null;
    for (const dir of this.#directions(node)) {
      const one = this.cache.get(keys.get(node) + SEP + dir + SEP + outer);
      if (one && (!best || one.cost < best.cost)) best = one;
    }
    if (outer === null) this.#settle(best);
    return best;
  }

  // Keep the directions of what is shown.
  #settle(result) {
    this.chosen.set(result.node.path, result.dir);
    for (const child of result.boxes) if (child.inner) this.#settle(child.inner);
  }

  #plan(node, open, keys, dir, outer, id) {
    const inner = new Map();
    for (const child of node.children)
      if (this.#isOpen(child, open)) inner.set(child.label, this.#best(child, dir, keys));
    return new Plan(node, dir, outer, id, inner);
  }
}

// One container as an ELK graph, with what every id means.
class Plan {
  constructor(node, dir, outer, id, inner) {
    Object.assign(this, { node, dir, outer, id, inner, means: new Map(), count: 0 });
    this.rows = dir === "RIGHT";
    this.outcomes = this.#shownOutcomes();
    this.graph = this.#frame();
    this.entry = this.#entry();
    this.ids = new Map(node.children.map((child) => [child.label, this.#child(child)]));
    this.targets = new Map(this.outcomes.map((o) => [o, this.#outcome(o)]));
    this.#edges();
  }

  #next(meaning) {
    const id = `${this.id}.${this.count++}`;
    this.means.set(id, meaning);
    return id;
  }

  #shownOutcomes() {
    const used = new Set(this.node.links.filter((l) => l.to_outcome).map((l) => l.target));
    if (this.outer !== null) { // the outermost shows only what something leads to
      for (const pill of this.node.pills) used.add(pill.outcome);
      for (const outcome of this.node.wired ?? []) used.add(outcome);
    }
    return this.node.outcomes.filter((o) => used.has(o));
  }

  #frame() {
    const { node, dir, outer } = this;
    const tag = { concurrence: 66, iterator: 52, sequence: 60 }[node.kind] ?? 8;
    const pill = Math.max(0, ...this.outcomes.map(pillWidth));
    const right = outer === "RIGHT" ? 14 + pill / 2 : 14;
    const bottom = outer === "DOWN" ? 20 : 14;
    return {
      id: this.id, children: [], edges: [], ports: [],
      labels: [{ text: node.shown, width: measure(node.shown, 11, true) + tag + 30, height: 17 }],
      layoutOptions: {
        ...SPACING,
        "elk.algorithm": "layered", "elk.direction": dir, "elk.edgeRouting": "ORTHOGONAL",
        "elk.hierarchyHandling": "SEPARATE_CHILDREN",
        "elk.padding": `[top=14,left=14,bottom=${bottom},right=${right}]`,
        "elk.layered.spacing.nodeNodeBetweenLayers": dir === "DOWN" ? "18" : "26",
        "elk.layered.nodePlacement.strategy": "NETWORK_SIMPLEX",
        "elk.layered.nodePlacement.favorStraightEdges": "true",
        "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
        "elk.layered.cycleBreaking.strategy": "MODEL_ORDER",
        "elk.layered.edgeLabels.sideSelection": "SMART_DOWN",
        "elk.nodeLabels.placement": "[H_LEFT, V_TOP, INSIDE]",
        "elk.nodeSize.constraints": "[NODE_LABELS, PORTS, PORT_LABELS, MINIMUM_SIZE]",
        "elk.portConstraints": "FIXED_SIDE",
      },
    };
  }

  #entry() {
    const id = this.#next({ kind: "entry" });
    if (this.outer === null)
      this.graph.children.push({ id, width: 9, height: 9,
        layoutOptions: { "elk.layered.layering.layerConstraint": "FIRST" } });
    else
      this.graph.ports.push({ id, width: ENTRY, height: ENTRY, layoutOptions: {
        "elk.port.side": FLOW[this.outer].in, "elk.port.borderOffset": String(-ENTRY / 2) } });
    return id;
  }

  #child(child) {
    const inner = this.inner.get(child.label);
    return inner ? this.#openChild(child, inner) : this.#leaf(child);
  }

  #openChild(child, inner) {
    const ports = new Map();
    const id = this.#next({ kind: "open", child, inner });
    let entry = null;
    const elkPorts = inner.ports.map((p) => {
      const port = this.#next({ kind: "port" });
      if (p.entry) entry = port; else ports.set(p.outcome, port);
      const offset = p.entry ? -ENTRY / 2 : this.dir === "DOWN" ? -p.h / 2 : -p.w / 2;
      return { id: port, x: p.x, y: p.y, width: p.w, height: p.h, layoutOptions: {
        "elk.port.side": FLOW[this.dir][p.entry ? "in" : "out"],
        "elk.port.borderOffset": String(offset) } };
    });
    this.graph.children.push({ id, width: inner.w, height: inner.h, ports: elkPorts,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" } });
    return { entry: entry ?? id, out: (outcome) => ports.get(outcome) ?? id, split: true };
  }

  #leaf(child) {
    const width = leafWidth(child);
    if (!this.rows || !child.wired.length) {
      const id = this.#next({ kind: "leaf", child });
      this.graph.children.push({ id, width, height: LEAF_H });
      return { entry: id, out: () => id, split: false };
    }
    const text = Math.max(...child.wired.map((o) => measure(o, 9))) + 16;
    const single = child.wired.length === 1;
    const h = single ? LEAF_H : Math.max(LEAF_H, 10 + child.wired.length * ROW);
    const w = width - 4 + text;
    const id = this.#next({ kind: "leaf", child, rows: true, nameWidth: width });
    const top = (h - child.wired.length * ROW) / 2;
    const ports = new Map();
    const elkPorts = child.wired.map((outcome, i) => {
      const port = this.#next({ kind: "dot", outcome });
      ports.set(outcome, port);
      return { id: port, x: w - 3.5, y: single ? h / 2 - 3.5 : top + i * ROW + 3.5, width: 7, height: 7,
        layoutOptions: { "elk.port.side": "EAST", "elk.port.borderOffset": "-3.5" } };
    });
    this.graph.children.push({ id, width: w, height: h, ports: elkPorts,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" } });
    return { entry: id, out: (outcome) => ports.get(outcome) ?? id, split: true };
  }

  #outcome(outcome) {
    const w = pillWidth(outcome) + (this.outer === null ? 4 : 0);
    const id = this.#next({ kind: "pill", outcome, end: this.outer === null });
    if (this.outer === null)
      this.graph.children.push({ id, width: w, height: 18,
        layoutOptions: { "elk.layered.layering.layerConstraint": "LAST" } });
    else {
      const offset = this.outer === "DOWN" ? -PILL_H / 2 : -w / 2;
      this.graph.ports.push({ id, width: w, height: PILL_H, layoutOptions: {
        "elk.port.side": FLOW[this.outer].out, "elk.port.borderOffset": String(offset) } });
    }
    return id;
  }

  #edges() {
    const { node } = this;
    for (const label of node.initial) {
      const target = this.ids.get(label);
      if (target) this.#edge({ kind: node.kind === "concurrence" ? "fork" : "initial", outcomes: [] },
        this.entry, target.entry);
    }
    for (const link of node.links) {
      const source = this.ids.get(link.source);
      const target = link.to_outcome ? this.targets.get(link.target) : this.ids.get(link.target)?.entry;
      if (!source || !target) continue;
      const about = { kind: "link", link, source: `${node.path}/${link.source}` };
      if (source.split)
        for (const outcome of link.outcomes)
          this.#edge({ ...about, outcomes: [outcome] }, source.out(outcome), target);
      else {
        const plain = link.to_outcome && link.outcomes.length === 1 && link.outcomes[0] === link.target;
        this.#edge({ ...about, outcomes: link.outcomes }, source.out(), target,
          plain ? [] : link.outcomes);
      }
    }
  }

  #edge(meaning, source, target, labels = []) {
    const id = this.#next(meaning);
    this.graph.edges.push({ id, sources: [source], targets: [target],
      labels: labels.map((text) => ({ text, width: measure(text, 9) + 6, height: 12 })) });
  }
}

const cost = (w, h) => Math.max(w, 1.6 * h) + 0.15 * Math.sqrt(w * h);

// What ELK found, in our words, relative to the container's corner.
function finish({ plan, node, dir }, box) {
  const result = { node, dir, w: box.width, h: box.height, cost: cost(box.width, box.height),
    boxes: [], pills: [], ports: [], edges: [], entry: null };
  for (const port of box.ports ?? []) {
    const about = plan.means.get(port.id);
    const place = { x: port.x, y: port.y, w: port.width, h: port.height };
    result.ports.push({ ...place, entry: about.kind === "entry", outcome: about.outcome });
    if (about.kind === "entry") result.entry = { x: port.x + 5, y: port.y + 5 };
    else result.pills.push({ ...place, outcome: about.outcome });
  }
  for (const child of box.children) {
    const about = plan.means.get(child.id);
    const place = { x: child.x, y: child.y, w: child.width, h: child.height };
    if (about.kind === "entry") result.entry = { x: child.x + 4.5, y: child.y + 4.5 };
    else if (about.kind === "pill") result.pills.push({ ...place, outcome: about.outcome, end: true });
    else
      result.boxes.push({ ...place, node: about.child, inner: about.inner ?? null, rows: about.rows,
        nameWidth: about.nameWidth, dots: about.rows ? dots(child, plan) : [] });
  }
  for (const edge of box.edges) {
    const about = plan.means.get(edge.id);
    for (const section of edge.sections ?? [])
      result.edges.push({ ...about,
        points: [section.startPoint, ...(section.bendPoints ?? []), section.endPoint],
        labels: (edge.labels ?? []).map((l) => ({ x: l.x + l.width / 2, y: l.y, text: l.text })) });
  }
  return result;
}

const dots = (child, plan) => (child.ports ?? []).map((port) => ({
  x: port.x + 3.5, y: port.y + 3.5, outcome: plan.means.get(port.id).outcome }));
