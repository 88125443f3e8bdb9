// Where things are: one ELK graph per open container, bottom-up, in a worker, and cached.
// Opening or closing a container lays out itself and its ancestors only.
import { joinText } from "#core/model.js";
import { measure } from "#drawing/measure.js";

/**
 * @typedef {{ id: string, [property: string]: any }} ElkElement what ELK knows; see its JSON format
 * @typedef {Box & { entry: boolean, outcome: string }} PlacedPort
 * @typedef {Box & { outcome: string }} PlacedPill
 * @typedef {Box & {
 *   node: StateNode, inner: ContainerLayout | null, hasRows: boolean, nameWidth: number,
 *   dots: (Point & { outcome: string })[],
 * }} PlacedBox a state, with a row for each of its outcomes or without
 * @typedef {Box & { join: Join }} PlacedJoin
 * @typedef {{
 *   kind: "link" | "initial" | "fork", link?: Link, join?: Join, source: string, outcomes: string[],
 *   points: Point[], labels: (Point & { text: string })[],
 * }} PlacedEdge
 * @typedef {{
 *   node: StateNode, dir: Direction, w: number, h: number, cost: number, boxes: PlacedBox[],
 *   pills: PlacedPill[], joins: PlacedJoin[], ports: PlacedPort[], edges: PlacedEdge[], entry: Point | null,
 * }} ContainerLayout where things are in a container, relative to its corner
 * @typedef {{ entry: string, out: (outcome?: string) => string, split: boolean }} Ends ids to connect a state by
 */

const SEP = "\u0001";
const ROW_H = 14;
const LEAF_H = 26;
const PILL_H = 15;
const ENTRY = 10;
const BAR = 6; // thickness of a join
const MOST_CACHED = 2000; // layouts of containers
/** @type {Direction[]} */
const DIRECTIONS = ["DOWN", "RIGHT"];
const FLOW = {
  DOWN: { out: "SOUTH", in: "NORTH" },
  RIGHT: { out: "EAST", in: "WEST" },
};
const SPACING = {
  "elk.spacing.nodeNode": "18",
  "elk.spacing.edgeNode": "11",
  "elk.spacing.edgeEdge": "9",
  "elk.layered.spacing.edgeNodeBetweenLayers": "11",
  "elk.layered.spacing.edgeEdgeBetweenLayers": "9",
  "elk.spacing.edgeLabel": "3",
  "elk.spacing.portPort": "10",
  "elk.spacing.componentComponent": "22",
};

class Elk {
  /** @type {Map<number, { done: (graph: any) => void, fail: (error: Error) => void }>} */
  #calls = new Map();
  #count = 0;

  /** @param {Worker} worker */
  constructor(worker) {
    this.worker = worker;
    worker.onmessage = ({ data }) => {
      const call = this.#calls.get(data.id);
      this.#calls.delete(data.id);
      if (!call) return;
      if (data.error) call.fail(new Error(data.error.message ?? String(data.error)));
      else call.done(data.data);
    };
    worker.onerror = (e) => {
      for (const { fail } of this.#calls.values()) fail(new Error(e.message || "its worker could not start"));
      this.#calls.clear();
    };
    this.ready = this.#ask({ cmd: "register", algorithms: ["layered"] });
    this.ready.catch(() => {}); // `layout` raises it
  }

  /** @param {ElkElement} graph @returns {Promise<ElkElement>} */
  async layout(graph) {
    await this.ready;
    return this.#ask({ cmd: "layout", graph, layoutOptions: {}, options: {} });
  }

  /** @param {object} message @returns {Promise<any>} */
  #ask(message) {
    const id = this.#count++;
    return new Promise((done, fail) => {
      this.#calls.set(id, { done, fail });
      this.worker.postMessage({ id, ...message });
    });
  }
}

/** @param {string} outcome */
export const pillWidth = (outcome) => measure(outcome, 9, true) + 15;

/** @param {StateNode} node */
export function leafWidth(node) {
  const closed = node.children.length ? 20 + measure(String(node.total - 1), 9) : 0;
  return Math.max(56, 44 + measure(node.shown, 11, true) + closed);
}

export class Layout {
  /** @type {Map<string, ContainerLayout>} */
  cache = new Map(); // by container, what is open in it, its direction and that around it
  /** @type {Map<string, Direction>} */
  chosen = new Map(); // of the containers shown, kept so that nothing jumps about

  /** @param {Worker} worker */
  constructor(worker) {
    this.elk = new Elk(worker);
  }

  clear() {
    this.forget();
    this.chosen.clear();
  }

  /** Forget the layouts, but keep the directions. */
  forget() {
    this.cache.clear();
  }

  /**
   * Lay out everything below `root`, with the containers of `open` opened.
   * @param {StateNode} root
   * @param {Set<string>} open
   */
  async run(root, open) {
    if (this.cache.size > MOST_CACHED) this.forget();
    /** @type {StateNode[][]} */
    const levels = []; // innermost containers first
    /** @type {(node: StateNode) => number} */
    const height = (node) => {
      if (!isOpen(node, open)) return -1;
      const h = 1 + Math.max(-1, ...node.children.map(height));
      levels[h] ??= [];
      levels[h].push(node);
      return h;
    };
    if (height(root) < 0) return null;
    const keys = new Map();
    for (const node of levels.flat()) keys.set(node, keyOf(node, open, keys));
    for (const level of levels) await this.#layOut(level, root, open, keys);
    return this.#best(root, null, keys);
  }

  /** @param {StateNode} node @returns {Direction[]} */
  #directions(node) {
    const chosen = this.chosen.get(node.path);
    return chosen ? [chosen] : DIRECTIONS;
  }

  /**
   * @param {StateNode[]} level
   * @param {StateNode} root
   * @param {Set<string>} open
   * @param {Map<StateNode, string>} keys
   */
  async #layOut(level, root, open, keys) {
    const plans = [];
    for (const node of level)
      for (const outer of node === root ? [null] : DIRECTIONS)
        for (const dir of this.#directions(node)) {
          const key = keys.get(node) + SEP + dir + SEP + outer;
          if (this.cache.has(key)) continue;
          plans.push({
            key,
            plan: new Plan(node, dir, outer, `g${plans.length}`, this.#inside(node, open, keys, dir)),
          });
        }
    if (!plans.length) return;
    const result = await this.elk.layout({
      id: "batch",
      layoutOptions: { "elk.algorithm": "fixed" },
      children: plans.map(({ plan }) => plan.graph),
      edges: [],
    });
    for (const [i, { key, plan }] of plans.entries()) this.cache.set(key, placed(plan, result.children[i]));
  }

  /**
   * The layouts of the open containers in a container, by label.
   * @param {StateNode} node
   * @param {Set<string>} open
   * @param {Map<StateNode, string>} keys
   * @param {Direction} dir
   */
  #inside(node, open, keys, dir) {
    const inner = new Map();
    for (const child of node.children) if (isOpen(child, open)) inner.set(child.label, this.#best(child, dir, keys));
    return inner;
  }

  /** @param {StateNode} node @param {Direction | null} outer @param {Map<StateNode, string>} keys */
  #best(node, outer, keys) {
    /** @type {ContainerLayout | null} */
    let best = null;
    for (const dir of this.#directions(node)) {
      const one = this.cache.get(keys.get(node) + SEP + dir + SEP + outer);
      if (one && (!best || one.cost < best.cost)) best = one;
    }
    if (outer === null && best) this.#settle(best);
    return best;
  }

  /** Keep the directions of what is shown. @param {ContainerLayout} result */
  #settle(result) {
    this.chosen.set(result.node.path, result.dir);
    for (const child of result.boxes) if (child.inner) this.#settle(child.inner);
  }
}

/** @param {StateNode} node @param {Set<string>} open */
const isOpen = (node, open) => node.children.length > 0 && open.has(node.path);

/** @param {StateNode} node @param {Set<string>} open @param {Map<StateNode, string>} keys */
function keyOf(node, open, keys) {
  const inner = node.children.filter((child) => isOpen(child, open)).map((child) => keys.get(child));
  return `${node.path}(${inner.join(SEP)})`;
}

// One container as an ELK graph, with what every id in it means.
class Plan {
  /** @type {Map<string, any>} */
  meanings = new Map();
  #count = 0;

  /**
   * @param {StateNode} node
   * @param {Direction} dir its own
   * @param {Direction | null} outer that of the container around it; null: it is the outermost
   * @param {string} id
   * @param {Map<string, ContainerLayout>} inner by label
   */
  constructor(node, dir, outer, id, inner) {
    this.node = node;
    this.dir = dir;
    this.outer = outer;
    this.id = id;
    this.inner = inner;
    this.hasRows = dir === "RIGHT";
    this.outcomes = this.#shownOutcomes();
    this.graph = this.#frame();
    this.entry = this.#entry();
    /** @type {Map<string, Ends>} */
    this.ends = new Map(node.children.map((child) => [child.label, this.#child(child)]));
    this.targets = new Map(this.outcomes.map((outcome) => [outcome, this.#outcome(outcome)]));
    this.bars = node.joins.map((join) => this.#join(join));
    this.#edges();
  }

  /** @param {Record<string, unknown>} meaning */
  #next(meaning) {
    const id = `${this.id}.${this.#count++}`;
    this.meanings.set(id, meaning);
    return id;
  }

  #shownOutcomes() {
    const used = new Set(this.node.links.filter((link) => link.to_outcome).map((link) => link.target));
    if (this.outer !== null) {
      // the outermost shows only what something leads to
      for (const pill of this.node.pills) used.add(pill.outcome);
      for (const outcome of this.node.wired ?? []) used.add(outcome);
    }
    return this.node.outcomes.filter((outcome) => used.has(outcome));
  }

  /** @returns {ElkElement} */
  #frame() {
    const { node, dir, outer } = this;
    const tag = { concurrence: 66, iterator: 52, sequence: 60 }[node.kind] ?? 8;
    const pill = Math.max(0, ...this.outcomes.map(pillWidth));
    const right = outer === "RIGHT" ? 14 + pill / 2 : 14;
    const bottom = outer === "DOWN" ? 20 : 14;
    return {
      id: this.id,
      children: [],
      edges: [],
      ports: [],
      labels: [{ text: node.shown, width: measure(node.shown, 11, true) + tag + 30, height: 17 }],
      layoutOptions: {
        ...SPACING,
        "elk.algorithm": "layered",
        "elk.direction": dir,
        "elk.edgeRouting": "ORTHOGONAL",
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
      this.graph.children.push({
        id,
        width: 9,
        height: 9,
        layoutOptions: { "elk.layered.layering.layerConstraint": "FIRST" },
      });
    else
      this.graph.ports.push({
        id,
        width: ENTRY,
        height: ENTRY,
        layoutOptions: { "elk.port.side": FLOW[this.outer].in, "elk.port.borderOffset": String(-ENTRY / 2) },
      });
    return id;
  }

  /** @param {StateNode} child @returns {Ends} */
  #child(child) {
    const inner = this.inner.get(child.label);
    return inner ? this.#openChild(child, inner) : this.#leaf(child);
  }

  /** @param {StateNode} child @param {ContainerLayout} inner @returns {Ends} */
  #openChild(child, inner) {
    const out = new Map();
    const id = this.#next({ kind: "open", child, inner });
    let entry = id;
    const ports = inner.ports.map((p) => {
      const port = this.#next({ kind: "port" });
      if (p.entry) entry = port;
      else out.set(p.outcome, port);
      const offset = p.entry ? -ENTRY / 2 : this.dir === "DOWN" ? -p.h / 2 : -p.w / 2;
      const side = FLOW[this.dir][p.entry ? "in" : "out"];
      return {
        id: port,
        x: p.x,
        y: p.y,
        width: p.w,
        height: p.h,
        layoutOptions: { "elk.port.side": side, "elk.port.borderOffset": String(offset) },
      };
    });
    this.graph.children.push({
      id,
      width: inner.w,
      height: inner.h,
      ports,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" },
    });
    return { entry, out: (outcome) => out.get(outcome) ?? id, split: true };
  }

  /** @param {StateNode} child @returns {Ends} */
  #leaf(child) {
    const width = leafWidth(child);
    if (!this.hasRows || !child.wired.length) {
      const id = this.#next({ kind: "leaf", child });
      this.graph.children.push({ id, width, height: LEAF_H });
      return { entry: id, out: () => id, split: false };
    }
    const text = Math.max(...child.wired.map((outcome) => measure(outcome, 9))) + 16;
    const single = child.wired.length === 1;
    const h = single ? LEAF_H : Math.max(LEAF_H, 10 + child.wired.length * ROW_H);
    const w = width - 4 + text;
    const id = this.#next({ kind: "leaf", child, hasRows: true, nameWidth: width });
    const top = (h - child.wired.length * ROW_H) / 2;
    const out = new Map();
    const ports = child.wired.map((outcome, i) => {
      const port = this.#next({ kind: "dot", outcome });
      out.set(outcome, port);
      return {
        id: port,
        x: w - 3.5,
        y: single ? h / 2 - 3.5 : top + i * ROW_H + 3.5,
        width: 7,
        height: 7,
        layoutOptions: { "elk.port.side": "EAST", "elk.port.borderOffset": "-3.5" },
      };
    });
    this.graph.children.push({
      id,
      width: w,
      height: h,
      ports,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" },
    });
    return { entry: id, out: (outcome) => out.get(outcome) ?? id, split: true };
  }

  /** @param {string} outcome */
  #outcome(outcome) {
    const w = pillWidth(outcome) + (this.outer === null ? 4 : 0);
    const id = this.#next({ kind: "pill", outcome });
    if (this.outer === null)
      this.graph.children.push({
        id,
        width: w,
        height: 18,
        layoutOptions: { "elk.layered.layering.layerConstraint": "LAST" },
      });
    else {
      const offset = this.outer === "DOWN" ? -PILL_H / 2 : -w / 2;
      this.graph.ports.push({
        id,
        width: w,
        height: PILL_H,
        layoutOptions: { "elk.port.side": FLOW[this.outer].out, "elk.port.borderOffset": String(offset) },
      });
    }
    return id;
  }

  /** @param {Join} join */
  #join(join) {
    const id = this.#next({ kind: "join", join });
    const long = 12 + 12 * join.conditions.length;
    const [width, height] = this.dir === "DOWN" ? [long, BAR] : [BAR, long];
    this.graph.children.push({ id, width, height });
    return id;
  }

  #edges() {
    const { node } = this;
    for (const label of node.initial) {
      const kind = node.kind === "concurrence" ? "fork" : "initial";
      const target = this.ends.get(label);
      if (target) this.#edge({ kind, source: "", outcomes: [] }, this.entry, target.entry);
    }
    for (const link of node.links) {
      const source = this.ends.get(link.source);
      const outcome = link.join === null ? this.targets.get(link.target) : this.bars[link.join];
      const target = link.to_outcome ? outcome : this.ends.get(link.target)?.entry;
      if (!source || !target) continue;
      const meaning = { kind: "link", link, source: `${node.path}/${link.source}` };
      if (source.split)
        for (const outcome of link.outcomes)
          this.#edge({ ...meaning, outcomes: [outcome] }, source.out(outcome), target);
      else {
        const plain =
          link.to_outcome && link.join === null && link.outcomes.length === 1 && link.outcomes[0] === link.target;
        this.#edge({ ...meaning, outcomes: link.outcomes }, source.out(), target, plain ? [] : link.outcomes);
      }
    }
    for (const [i, join] of node.joins.entries()) {
      const target = this.targets.get(join.outcome);
      const meaning = { kind: "link", join, source: node.path, outcomes: [join.outcome] };
      // As wide as what stands there while it waits
      if (target) this.#edge(meaning, this.bars[i], target, [joinText(join, join.need - 1)]);
    }
  }

  /**
   * @param {Record<string, unknown>} meaning
   * @param {string} source
   * @param {string} target
   * @param {string[]} [labels]
   */
  #edge(meaning, source, target, labels = []) {
    this.graph.edges.push({
      id: this.#next(meaning),
      sources: [source],
      targets: [target],
      labels: labels.map((text) => ({ text, width: measure(text, 9) + 6, height: 12 })),
    });
  }
}

/** @param {number} w @param {number} h */
const cost = (w, h) => Math.max(w, 1.6 * h) + 0.15 * Math.sqrt(w * h);

/**
 * What ELK found, in the page's terms.
 * @param {Plan} plan
 * @param {ElkElement} found
 * @returns {ContainerLayout}
 */
function placed(plan, found) {
  /** @type {ContainerLayout} */
  const result = {
    node: plan.node,
    dir: plan.dir,
    w: found.width,
    h: found.height,
    cost: cost(found.width, found.height),
    boxes: [],
    pills: [],
    joins: [],
    ports: [],
    edges: [],
    entry: null,
  };
  for (const port of found.ports ?? []) {
    const { kind, outcome } = plan.meanings.get(port.id);
    const place = { x: port.x, y: port.y, w: port.width, h: port.height };
    result.ports.push({ ...place, entry: kind === "entry", outcome });
    if (kind === "entry") result.entry = { x: port.x + 5, y: port.y + 5 };
    else result.pills.push({ ...place, outcome });
  }
  for (const child of found.children) {
    const meaning = plan.meanings.get(child.id);
    const place = { x: child.x, y: child.y, w: child.width, h: child.height };
    if (meaning.kind === "entry") result.entry = { x: child.x + 4.5, y: child.y + 4.5 };
    else if (meaning.kind === "join") result.joins.push({ ...place, join: meaning.join });
    else if (meaning.kind === "pill") result.pills.push({ ...place, outcome: meaning.outcome });
    else
      result.boxes.push({
        ...place,
        node: meaning.child,
        inner: meaning.inner ?? null,
        hasRows: Boolean(meaning.hasRows),
        nameWidth: meaning.nameWidth ?? 0,
        dots: meaning.hasRows ? dotsOf(child, plan) : [],
      });
  }
  for (const edge of found.edges)
    for (const section of edge.sections ?? [])
      result.edges.push({
        ...plan.meanings.get(edge.id),
        points: [section.startPoint, ...(section.bendPoints ?? []), section.endPoint],
        labels: (edge.labels ?? []).map((/** @type {ElkElement} */ label) => ({
          x: label.x + label.width / 2,
          y: label.y,
          text: label.text,
        })),
      });
  return result;
}

/** @param {ElkElement} child @param {Plan} plan */
const dotsOf = (child, plan) =>
  (child.ports ?? []).map((/** @type {ElkElement} */ port) => ({
    x: port.x + 3.5,
    y: port.y + 3.5,
    outcome: plan.meanings.get(port.id).outcome,
  }));
