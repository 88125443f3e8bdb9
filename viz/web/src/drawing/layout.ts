// The layout of the diagram: one ELK graph per open container, from the innermost out, in a worker. Results are cached,
// so that opening or closing a container lays out only this container and those around it.

import { hasManyBranches } from "#core/model.ts";
import type { Direction, StateNode } from "#core/types.ts";
import { cards } from "#drawing/cards.ts";
import { Elk } from "#drawing/elk.ts";
import { overview } from "#drawing/overview.ts";
import { type ContainerLayout, DIRECTIONS, isOpen, SEP } from "#drawing/placed.ts";
import { Plan } from "#drawing/plan.ts";
import { isSound, placed } from "#drawing/results.ts";
import { badness, hasOver, nameOf, shapesOf } from "#drawing/shapes.ts";

const MOST_CACHED = 2000; // layouts of containers
const OVERVIEW_FROM = 150; // visible states from which they are drawn as tiles
const TANGLED = { links: 100, perState: 6 }; // arrows of a container from which states are drawn as tiles
const INNER_ASPECTS = [1, 0.5, 2]; // of inner containers that are tried, relative to that of the view
const TRIED_UNTIL = 80; // visible states up to which all of them are tried
const ASPECTS = { least: 0.6, most: 5 };
const SAME_ASPECT = 0.15; // difference of logarithms below which two aspects count as equal
const within = (aspect: number) => Math.max(ASPECTS.least, Math.min(ASPECTS.most, aspect));
export class Layout {
  elk: Elk;
  /** By container, open containers in it, its direction and that of the container around it. */
  cache: Map<string, ContainerLayout> = new Map();
  chosen: Map<string, string> = new Map(); // shapes of the containers shown, kept so that the picture stays stable
  tried: Map<string, string[]> = new Map(); // names of the shapes of a container, by the open containers in it
  aspect = 1.6; // of the room in the view: its width divided by its height
  inner = 1; // factor on it, for inner containers

  constructor(worker: Worker) {
    this.elk = new Elk(worker);
  }

  clear() {
    this.forget();
    this.choose(this.aspect);
  }

  /** Choose the shapes anew for a view of that aspect. */
  choose(aspect: number) {
    this.chosen.clear();
    const next = within(aspect);
    if (Math.abs(next - this.aspect) > 0.1 * this.aspect) this.forget(); // grids and folds depend on it
    this.aspect = next;
  }

  /** Whether the shapes were chosen for a view of about that aspect. */
  suits(aspect: number) {
    return Math.abs(Math.log(within(aspect) / this.aspect)) < SAME_ASPECT;
  }

  /** Forget the layouts, but keep the shapes. */
  forget() {
    this.cache.clear();
    this.tried.clear();
  }

  /**
   * Lay out everything below `root`, with the containers of `open` opened.
   * @param onProgress called with the number of states that are laid out
   * @param asTiles whether states are to be tiles without arrows, however few they are
   * @throws ELK fails for the root; a container inside for which it fails is shown closed
   */
  async run(
    root: StateNode,
    open: Set<string>,
    onProgress?: (done: number, all: number) => void,
    asTiles: boolean = false,
  ) {
    const all = countOf(root, open);
    if (asTiles || all > OVERVIEW_FROM || isTangled(root, open)) return overview(root, open, this.aspect);
    if (this.cache.size > MOST_CACHED) this.forget();
    const levels: StateNode[][] = []; // innermost containers first
    const height: (node: StateNode) => number = (node) => {
      if (!isOpen(node, open)) return -1;
      const h = 1 + Math.max(-1, ...node.children.map(height));
      levels[h] ??= [];
      levels[h].push(node);
      return h;
    };
    if (height(root) < 0) return null;
    // What is best for an inner container alone may fill the view badly: other shapes of it are tried, too.
    const isSettled = this.chosen.has(root.path) || all > TRIED_UNTIL || levels.length < 2;
    let best: ContainerLayout | null = null;
    for (const inner of isSettled ? [1] : INNER_ASPECTS) {
      this.inner = inner;
      const keys = new Map();
      for (const node of levels.flat()) keys.set(node, keyOf(node, open, keys, inner));
      let done = 0;
      for (const level of levels) {
        await this.#layOut(level, root, open, keys);
        done += level.reduce((sum, node) => sum + node.children.length, 0);
        onProgress?.(done, all);
      }
      const found = this.#best(root, null, keys);
      if (found && (!best || badness(found, this.aspect) < badness(best, this.aspect))) best = found;
    }
    this.inner = 1;
    if (!best) throw new Error(`ELK fails at every layout of ${root.name}`);
    this.#settle(best);
    return best;
  }

  async #layOut(level: StateNode[], root: StateNode, open: Set<string>, keys: Map<StateNode, string>) {
    const plans = [];
    for (const node of level) {
      const known = keys.get(node) ?? "";
      if (areCards(node, open)) {
        for (const outer of node === root ? [null] : DIRECTIONS)
          this.cache.set(known + SEP + CARDS + SEP + outer, cards(node, outer, this.aspect));
        this.tried.set(known, [CARDS]);
        continue;
      }
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
   * Let ELK lay out some plans. It fails for some graphs, and folds others wrongly: these are left out. Returns whether
   * it did all of them.
   */
  async #place(plans: { key: string; plan: Plan }[]) {
    const batch = (some: typeof plans) =>
      this.elk.layout({
        id: "batch",
        layoutOptions: { "elk.algorithm": "fixed" },
        children: some.map(({ plan }) => plan.graph),
        edges: [],
      });
    try {
      const result = await batch(plans);
      const layouts = plans.map(({ plan }, i) => placed(plan, result.children[i]));
      for (const [i, { key }] of plans.entries()) if (isSound(layouts[i])) this.cache.set(key, layouts[i]);
      return layouts.every(isSound);
    } catch (error) {
      if (plans.length === 1) {
        console.warn(`no layout of ${plans[0].plan.node.path}: ${error}`);
        return false;
      }
      for (const one of plans) await this.#place([one]);
      return false;
    }
  }

  /** The layouts of the open containers in a container, by label. */
  #inside(node: StateNode, open: Set<string>, keys: Map<StateNode, string>, dir: Direction) {
    const inner = new Map();
    for (const child of node.children) if (isOpen(child, open)) inner.set(child.label, this.#best(child, dir, keys));
    return inner;
  }

  #best(node: StateNode, outer: Direction | null, keys: Map<StateNode, string>) {
    let best: ContainerLayout | null = null;
    const known = keys.get(node) ?? "";
    const chosen = this.chosen.get(node.path);
    const names = this.tried.get(known) ?? [];
    const aspect = outer === null ? this.aspect : this.aspect * this.inner;
    for (const name of chosen !== undefined && names.includes(chosen) ? [chosen] : names) {
      const one = this.cache.get(known + SEP + name + SEP + outer);
      if (one && (!best || badness(one, aspect) < badness(best, aspect))) best = one;
    }
    return best;
  }

  /** Keep the shapes of the containers shown. */
  #settle(result: ContainerLayout) {
    if (!result.shape.cards) this.chosen.set(result.node.path, nameOf(result.shape));
    for (const child of result.boxes) if (child.inner) this.#settle(child.inner);
  }
}

/** Whether the arrows of a visible container are too many to follow. */
const isTangled = (node: StateNode, open: Set<string>): boolean =>
  isOpen(node, open) && (hasOver(node, TANGLED) || node.children.some((child) => isTangled(child, open)));

/** The number of visible states. */
const countOf = (node: StateNode, open: Set<string>): number =>
  isOpen(node, open) ? node.children.reduce((sum, child) => sum + countOf(child, open), 1) : 1;

const CARDS = "cards"; // name of that shape

/** Whether a container is drawn as cards: a concurrence of many branches, all closed. */
const areCards = (node: StateNode, open: Set<string>) =>
  hasManyBranches(node) && !node.children.some((child) => isOpen(child, open) || child.change);

/** What a layout of a container depends on, besides its own shape. */
function keyOf(node: StateNode, open: Set<string>, keys: Map<StateNode, string>, inner: number) {
  const inside = node.children.filter((child) => isOpen(child, open)).map((child) => keys.get(child));
  return `${node.path}(${inside.join(SEP)})${inside.length && inner !== 1 ? inner : ""}`;
}
