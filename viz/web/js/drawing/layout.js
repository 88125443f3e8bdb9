// The layout of the diagram: one ELK graph per open container, from the innermost out, in a worker. Results are cached,
// so that opening or closing a container lays out only this container and those around it.
import { joinText } from "#core/model.js";
import { shorten } from "#core/text.js";
import { measure } from "#drawing/measure.js";

/**
 * @typedef {{ id: string, [property: string]: any }} ElkElement an element of ELK's JSON format
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
 *   node: StateNode, shape: Shape, w: number, h: number, boxes: PlacedBox[],
 *   pills: PlacedPill[], joins: PlacedJoin[], ports: PlacedPort[], edges: PlacedEdge[], entry: Point | null,
 *   isOverview?: boolean, head?: number,
 * }} ContainerLayout places of the parts of a container, relative to its corner
 * @typedef {{ dir: Direction, columns?: number, folded?: boolean }} Shape how a container is laid out: along a
 *   direction, in a grid with a number of columns, or folded like a long line of text
 * @typedef {{ entry: string, out: (outcome?: string) => string, split: boolean }} Ends ids to connect a state by
 */

const SEP = "\u0001";
const ROW_H = 14;
const LEAF_H = 26;
const PILL_H = 15;
const ENTRY = 10;
const BAR = 6; // thickness of a join
const MOST_CACHED = 2000; // layouts of containers
const GRID_FROM = 4; // children of a concurrence from which a grid is tried
const FOLD_FROM = 7; // children of another container from which folding is tried
const FOLD_COST = 1.3; // factor on the cost of a folded shape, because its lines are longer
const OVERVIEW_FROM = 150; // visible states from which they are drawn as tiles
const DENSE = { links: 48, perState: 4 }; // arrows of a container from which straight ones take too long to find
const TANGLED = { links: 100, perState: 6 }; // arrows of a container from which states are drawn as tiles
const TILE_GAP = 6;
const HEAD = 24; // height of the name of a tile
const HEAD_GROWS = 1.7; // factor for the name of each further level out
const MOST_COLUMNS = 60;
const ASPECTS = { least: 0.6, most: 2.4 };
const SAME_ASPECT = 0.15; // difference of logarithms below which two aspects count as equal
const within = (/** @type {number} */ aspect) => Math.max(ASPECTS.least, Math.min(ASPECTS.most, aspect));
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
    this.ready.catch(() => {}); // `layout` awaits it and throws the error
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
const pillWidth = (outcome) => measure(shorten(outcome), 9, true) + 15;

/** @param {StateNode} node */
function leafWidth(node) {
  const closed = node.children.length ? 20 + measure(String(node.total - 1), 9) : 0;
  return Math.max(56, 44 + measure(node.shown, 11, true) + closed);
}

export class Layout {
  /** @type {Map<string, ContainerLayout>} */
  cache = new Map(); // by container, open containers in it, its direction and that of the container around it
  /** @type {Map<string, string>} */
  chosen = new Map(); // shapes of the containers shown, kept so that the picture stays stable
  /** @type {Map<string, string[]>} */
  tried = new Map(); // names of the shapes of a container, by the open containers in it
  aspect = 1.6; // width of the view divided by its height

  /** @param {Worker} worker */
  constructor(worker) {
    this.elk = new Elk(worker);
  }

  clear() {
    this.forget();
    this.choose(this.aspect);
  }

  /** Choose the shapes anew for a view of that aspect. @param {number} aspect */
  choose(aspect) {
    this.chosen.clear();
    const next = within(aspect);
    if (Math.abs(next - this.aspect) > 0.1 * this.aspect) this.forget(); // grids and folds depend on it
    this.aspect = next;
  }

  /** Whether the shapes were chosen for a view of about that aspect. @param {number} aspect */
  suits(aspect) {
    return Math.abs(Math.log(within(aspect) / this.aspect)) < SAME_ASPECT;
  }

  /** Forget the layouts, but keep the shapes. */
  forget() {
    this.cache.clear();
    this.tried.clear();
  }

  /**
   * Lay out everything below `root`, with the containers of `open` opened.
   * @param {StateNode} root
   * @param {Set<string>} open
   * @param {(done: number, all: number) => void} [onProgress] called with the number of states that are laid out
   * @throws {Error} ELK fails for the root; a container inside for which it fails is shown closed
   */
  async run(root, open, onProgress) {
    const all = countOf(root, open);
    if (all > OVERVIEW_FROM || isTangled(root, open)) return overview(root, open, this.aspect);
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
    let done = 0;
    for (const level of levels) {
      await this.#layOut(level, root, open, keys);
      done += level.reduce((sum, node) => sum + node.children.length, 0);
      onProgress?.(done, all);
    }
    const best = this.#best(root, null, keys);
    if (!best) throw new Error(`ELK fails at every layout of ${root.name}`);
    return best;
  }

  /**
   * @param {StateNode[]} level
   * @param {StateNode} root
   * @param {Set<string>} open
   * @param {Map<StateNode, string>} keys
   */
  async #layOut(level, root, open, keys) {
    const plans = [];
    for (const node of level) {
      const known = keys.get(node) ?? "";
      const names = new Set(this.tried.get(known));
      const chosen = this.chosen.get(node.path);
      for (const outer of node === root ? [null] : DIRECTIONS)
        for (const shape of shapesOf(node, this.#inside(node, open, keys, "DOWN"), this.aspect)) {
          const name = nameOf(shape);
          if (chosen !== undefined && chosen !== name) continue;
          names.add(name);
          const key = known + SEP + name + SEP + outer;
          if (this.cache.has(key)) continue;
          const inner = this.#inside(node, open, keys, shape.dir);
          plans.push({ key, plan: new Plan(node, shape, outer, `g${plans.length}`, inner, this.aspect) });
        }
      this.tried.set(known, [...names]);
    }
    if (!plans.length) return;
    const isComplete = await this.#place(plans);
    if (isComplete) return;
    // If ELK failed for the chosen shape, any other is used.
    const laid = new Set(plans.filter(({ key }) => this.cache.has(key)).map(({ plan }) => plan.node));
    const stuck = level.filter((node) => this.chosen.has(node.path) && !laid.has(node));
    for (const node of stuck) this.chosen.delete(node.path);
    if (stuck.length) await this.#layOut(stuck, root, open, keys);
  }

  /**
   * Let ELK lay out some plans. It fails for some graphs, which are left out. Returns whether it did all of them.
   * @param {{ key: string, plan: Plan }[]} plans
   */
  async #place(plans) {
    const batch = (/** @type {typeof plans} */ some) =>
      this.elk.layout({
        id: "batch",
        layoutOptions: { "elk.algorithm": "fixed" },
        children: some.map(({ plan }) => plan.graph),
        edges: [],
      });
    try {
      const result = await batch(plans);
      for (const [i, { key, plan }] of plans.entries()) this.cache.set(key, placed(plan, result.children[i]));
      return true;
    } catch (error) {
      if (plans.length === 1) {
        console.warn(`no layout of ${plans[0].plan.node.path}: ${error}`);
        return false;
      }
      for (const one of plans) await this.#place([one]);
      return false;
    }
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
    const known = keys.get(node) ?? "";
    const chosen = this.chosen.get(node.path);
    const names = this.tried.get(known) ?? [];
    for (const name of chosen !== undefined && names.includes(chosen) ? [chosen] : names) {
      const one = this.cache.get(known + SEP + name + SEP + outer);
      if (one && (!best || badness(one, this.aspect) < badness(best, this.aspect))) best = one;
    }
    if (outer === null && best) this.#settle(best);
    return best;
  }

  /** Keep the shapes of the containers shown. @param {ContainerLayout} result */
  #settle(result) {
    this.chosen.set(result.node.path, nameOf(result.shape));
    for (const child of result.boxes) if (child.inner) this.#settle(child.inner);
  }
}

/**
 * Whether a container has more arrows than that, altogether and for each state.
 * @param {StateNode} node @param {{ links: number, perState: number }} limit
 */
const hasOver = ({ links, children }, limit) =>
  links.length > limit.links && links.length > limit.perState * children.length;

/**
 * Whether the arrows of a visible container are too many to follow.
 * @param {StateNode} node @param {Set<string>} open @returns {boolean}
 */
const isTangled = (node, open) =>
  isOpen(node, open) && (hasOver(node, TANGLED) || node.children.some((child) => isTangled(child, open)));

/** The number of visible states. @param {StateNode} node @param {Set<string>} open @returns {number} */
const countOf = (node, open) =>
  isOpen(node, open) ? node.children.reduce((sum, child) => sum + countOf(child, open), 1) : 1;

/**
 * The layout of a machine with too many open states for arrows: nested tiles in the order of the machine, so that a
 * state is always at the same place.
 * @param {StateNode} node
 * @param {Set<string>} open
 * @param {number} aspect
 * @returns {ContainerLayout}
 */
export function overview(node, open, aspect) {
  const tiles = node.children.map((child) => {
    const inner = isOpen(child, open) ? overview(child, open, aspect) : null;
    return { node: child, inner, w: inner?.w ?? leafWidth(child), h: inner?.h ?? LEAF_H };
  });
  // Outer containers have larger names, which are legible when the whole machine is in view.
  const head = HEAD_GROWS * Math.max(HEAD / HEAD_GROWS, ...tiles.map((tile) => tile.inner?.head ?? 0));
  const least = measure(node.shown, 11, true) * (head / HEAD) + 40;
  const tried = tiles.slice(0, MOST_COLUMNS).map((_, i) => inRows(tiles, i + 1, head, least));
  const best = tried.reduce((a, b) => (cost(b, aspect) < cost(a, aspect) ? b : a));
  const none = { pills: [], joins: [], ports: [], edges: [], entry: null };
  return { node, shape: { dir: "DOWN" }, ...best, ...none, head, isOverview: true };
}

/**
 * @param {{ node: StateNode, inner: ContainerLayout | null, w: number, h: number }[]} tiles
 * @param {number} columns
 * @param {number} head room for the name
 * @param {number} least width
 */
function inRows(tiles, columns, head, least) {
  let [y, w] = [head, least];
  const boxes = [];
  for (let i = 0; i < tiles.length; i += columns) {
    const row = tiles.slice(i, i + columns);
    let x = TILE_GAP;
    for (const tile of row) {
      boxes.push({ ...tile, x, y, hasRows: false, nameWidth: 0, dots: [] });
      x += tile.w + TILE_GAP;
    }
    w = Math.max(w, x);
    y += Math.max(...row.map((tile) => tile.h)) + TILE_GAP;
  }
  return { boxes, w, h: y };
}

/** The boxes of all drawn states, by path. @param {ContainerLayout} layout @param {number} x @param {number} y */
export function boxesOf(layout, x = 0, y = 0, found = /** @type {Map<string, Box>} */ (new Map())) {
  found.set(layout.node.path, { x, y, w: layout.w, h: layout.h });
  for (const { node, inner, ...box } of layout.boxes)
    if (inner) boxesOf(inner, x + box.x, y + box.y, found);
    else found.set(node.path, { x: x + box.x, y: y + box.y, w: box.w, h: box.h });
  return found;
}

/** @param {Shape} shape */
const nameOf = ({ dir, columns, folded }) => `${dir}${columns ?? ""}${folded ? "~" : ""}`;

/**
 * The shapes to try for a container.
 * @param {StateNode} node
 * @param {Map<string, ContainerLayout>} inner the open containers in it
 * @param {number} aspect
 * @returns {Shape[]}
 */
function shapesOf(node, inner, aspect) {
  /** @type {Shape[]} */
  const shapes = DIRECTIONS.map((dir) => ({ dir }));
  const { children } = node;
  if (node.kind !== "concurrence") {
    if (children.length >= FOLD_FROM) shapes.push(...DIRECTIONS.map((dir) => ({ dir, folded: true })));
    return shapes;
  }
  if (children.length < GRID_FROM) return shapes;
  const sizes = children.map((child) => inner.get(child.label) ?? { w: leafWidth(child), h: LEAF_H });
  /** @param {number} columns */
  const size = (columns) => {
    let [w, h] = [0, 0];
    for (let i = 0; i < sizes.length; i += columns) {
      const row = sizes.slice(i, i + columns);
      w = Math.max(
        w,
        row.reduce((sum, one) => sum + one.w + 30, 0),
      );
      h += Math.max(...row.map((one) => one.h)) + 40;
    }
    return { w, h };
  };
  const columns = children.map((_, i) => i + 1).slice(1, -1);
  const best = columns.reduce((a, b) => (cost(size(b), aspect) < cost(size(a), aspect) ? b : a));
  return [...shapes, { dir: "DOWN", columns: best }];
}

/** @param {StateNode} node @param {Set<string>} open */
const isOpen = (node, open) => node.children.length > 0 && open.has(node.path);

/** @param {StateNode} node @param {Set<string>} open @param {Map<StateNode, string>} keys */
function keyOf(node, open, keys) {
  const inner = node.children.filter((child) => isOpen(child, open)).map((child) => keys.get(child));
  return `${node.path}(${inner.join(SEP)})`;
}

// One container as an ELK graph, with the meaning of each id in it.
class Plan {
  /** @type {Map<string, any>} */
  meanings = new Map();
  #count = 0;

  /**
   * @param {StateNode} node
   * @param {Shape} shape its own
   * @param {Direction | null} outer direction of the container around it; null for the root
   * @param {string} id
   * @param {Map<string, ContainerLayout>} inner by label
   * @param {number} aspect aspect of the view, for folding
   */
  constructor(node, shape, outer, id, inner, aspect) {
    this.node = node;
    this.shape = shape;
    const { dir } = shape;
    this.dir = dir;
    this.outer = outer;
    this.id = id;
    this.inner = inner;
    this.hasRows = dir === "RIGHT"; // a row for each outcome
    this.outcomes = this.#shownOutcomes();
    this.graph = this.#frame();
    if (shape.columns)
      Object.assign(this.graph.layoutOptions, {
        "elk.partitioning.activate": "true",
        "elk.layered.nodePlacement.strategy": "SIMPLE", // rows are placed below each other
        "elk.separateConnectedComponents": "false",
      });
    if (shape.folded)
      Object.assign(this.graph.layoutOptions, {
        "elk.layered.wrapping.strategy": "MULTI_EDGE",
        "elk.aspectRatio": String(aspect),
      });
    this.entry = this.#entry();
    /** @type {Map<string, Ends>} */
    this.ends = new Map(node.children.map((child) => [child.label, this.#child(child)]));
    this.targets = new Map(this.outcomes.map((outcome) => [outcome, this.#outcome(outcome)]));
    this.bars = node.joins.map((join) => this.#join(join));
    if (shape.columns) this.#makeRows(shape.columns);
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
      // the root shows only outcomes to which something leads
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
    const name = measure(node.shown, 11, true) + tag + 30;
    const title = outer === "DOWN" ? 2 * name - 20 : name; // beside the line that enters at the top
    const right = outer === "RIGHT" ? 14 + pill / 2 : 14;
    const bottom = outer === "DOWN" ? 20 : 14;
    return {
      id: this.id,
      children: [],
      edges: [],
      ports: [],
      labels: [{ text: node.shown, width: title, height: 17 }],
      layoutOptions: {
        ...SPACING,
        "elk.algorithm": "layered",
        "elk.direction": dir,
        "elk.edgeRouting": "ORTHOGONAL",
        "elk.hierarchyHandling": "SEPARATE_CHILDREN",
        "elk.padding": `[top=14,left=14,bottom=${bottom},right=${right}]`,
        "elk.layered.spacing.nodeNodeBetweenLayers": dir === "DOWN" ? "18" : "26",
        // The simplex method makes more arrows straight, but takes minutes if twelve states all lead to each other.
        "elk.layered.nodePlacement.strategy": hasOver(node, DENSE) ? "BRANDES_KOEPF" : "NETWORK_SIMPLEX",
        "elk.layered.nodePlacement.favorStraightEdges": "true",
        "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
        // A plan lists all places before all transitions: in that order half of its arcs would point back.
        "elk.layered.cycleBreaking.strategy": node.kind === "plan" ? "DEPTH_FIRST" : "MODEL_ORDER",
        "elk.layered.edgeLabels.sideSelection": "SMART_DOWN",
        "elk.nodeLabels.placement": "[H_CENTER, V_TOP, INSIDE]",
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
    const text = Math.max(...child.wired.map((outcome) => measure(shorten(outcome), 9))) + 16;
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

  /** Arrange children in rows, with entry above and joins and outcomes below. @param {number} columns */
  #makeRows(columns) {
    const rows = Math.ceil(this.node.children.length / columns);
    let i = 0;
    for (const one of this.graph.children) {
      const { kind } = this.meanings.get(one.id);
      const row = { entry: 0, join: rows + 1, pill: rows + 2 }[/** @type {string} */ (kind)];
      one.layoutOptions = {
        ...one.layoutOptions,
        "elk.partitioning.partition": String(row ?? 1 + Math.floor(i++ / columns)),
      };
    }
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
      // In a grid the tag says that all children begin at once; lines to all of them would hide the children.
      if (target && !this.shape.columns) this.#edge({ kind, source: "", outcomes: [] }, this.entry, target.entry);
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
      // wide enough for its longest text, while it waits
      if (target) this.#edge(meaning, this.bars[i], target, [joinText(join, join.need - 1)]);
    }
    if (this.shape.folded && this.outer !== null) this.#reachOutcomes();
  }

  /** Lead an invisible line to each port without one: ELK cannot fold a container with an unconnected port. */
  #reachOutcomes() {
    const reached = new Set(this.graph.edges.map((/** @type {ElkElement} */ edge) => edge.targets[0]));
    const last = this.graph.children[this.graph.children.length - 1];
    for (const target of this.targets.values())
      if (!reached.has(target)) this.#edge({ kind: "hidden" }, last.id, target);
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
      labels: labels.map((text) => ({ text, width: measure(shorten(text), 9) + 6, height: 12 })),
    });
  }
}

/** The cost by which shapes are compared. @param {ContainerLayout} layout @param {number} aspect */
const badness = (layout, aspect) => cost(layout, aspect) * (layout.shape.folded ? FOLD_COST : 1);

/**
 * How badly a layout fills a view of an aspect: the smaller, the better.
 * @param {{ w: number, h: number }} size @param {number} aspect
 */
const cost = ({ w, h }, aspect) => Math.max(w, aspect * h) + 0.15 * Math.sqrt(w * h);

/**
 * ELK's result in the page's types.
 * @param {Plan} plan
 * @param {ElkElement} found
 * @returns {ContainerLayout}
 */
function placed(plan, found) {
  /** @type {ContainerLayout} */
  const result = {
    node: plan.node,
    shape: plan.shape,
    w: found.width,
    h: found.height,
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
  const drawn = found.edges.filter((/** @type {ElkElement} */ edge) => plan.meanings.get(edge.id).kind !== "hidden");
  for (const edge of drawn)
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
