// The lanes of the timeline: one for each container in which a state has run, with the spans of its states.

import { countWhile } from "#core/lists.ts";
import type { Model } from "#core/model.ts";
import type { Span, StateNode } from "#core/types.ts";

// Sizes in CSS pixels
const LANE = 19;
const ROW = 13;
const MOST_ROWS = 8; // that add to the height of a lane

export class Lanes {
  all: StateNode[] = []; // in the order of the tree
  #spansOf: Map<string, Span[]> = new Map(); // by path of the lane
  #model: Model | null = null;
  #spans: Span[] | null = null;
  #sorted = 0; // number of spans that are in lanes
  #planRows: Map<string, Span[]> = new Map(); // the newest span of each row, by path of a plan
  #rowOf: Map<Span, number> = new Map(); // of the actions of plans

  forget() {
    this.#model = null;
  }

  /** Put new spans into lanes; a container gets a lane when a state in it has run. */
  update(model: Model, spans: Span[]) {
    if (this.#model !== model || this.#spans !== spans) {
      // another machine, another run, or spans were dropped
      this.#spansOf.clear();
      this.#planRows.clear();
      this.#rowOf.clear();
      this.#sorted = 0;
      this.all = [];
    }
    this.#model = model;
    this.#spans = spans;
    const before = this.#spansOf.size;
    for (; this.#sorted < spans.length; this.#sorted++) {
      const span = spans[this.#sorted];
      const container = model.get(span.path)?.parent;
      if (!container) continue;
      const lane = container.path;
      if (container.kind === "plan") this.#placeInPlan(lane, span);
      const known = this.#spansOf.get(lane);
      if (known) known.push(span);
      else this.#spansOf.set(lane, [span]);
    }
    if (this.#spansOf.size !== before) this.all = model.order.filter((node) => this.#spansOf.has(node.path));
  }

  /** Actions of a plan that run at the same time get rows of their own. */
  #placeInPlan(lane: string, span: Span) {
    const rows = this.#planRows.get(lane) ?? [];
    this.#planRows.set(lane, rows);
    const free = rows.findIndex((last) => last.to !== null && last.to <= span.from);
    const row = free < 0 ? rows.length : free;
    rows[row] = span;
    this.#rowOf.set(span, row);
  }

  /** The number of a lane's rows. */
  rowsOf(lane: StateNode) {
    if (lane.kind === "concurrence") return lane.children.length;
    return this.#planRows.get(lane.path)?.length ?? 1;
  }

  /** The row of a state in its lane, at an instant [ms]. */
  rowAt(lane: StateNode, node: StateNode, t: number) {
    if (lane.kind === "concurrence") return lane.children.indexOf(node);
    if (!this.#planRows.has(lane.path)) return 0;
    const span = this.#spansOf.get(lane.path)?.findLast((one) => one.path === node.path && one.from <= t);
    return (span && this.#rowOf.get(span)) ?? 0;
  }

  /** [px] */
  heightOf(lane: StateNode) {
    const rows = this.rowsOf(lane);
    return rows > 1 || lane.kind === "concurrence" ? Math.max(LANE, ROW * Math.min(rows, MOST_ROWS) + 3) : LANE;
  }

  /** Of several lanes [px]. */
  totalOf(lanes: StateNode[]) {
    return lanes.reduce((sum, lane) => sum + this.heightOf(lane), 0);
  }

  /**
   * The spans of a lane in a range [ms], in order of their beginnings. Ends are only roughly in that order, so a few
   * that ended before the range are among them.
   */
  spansIn(lane: StateNode, from: number, to: number) {
    const spans = this.#spansOf.get(lane.path) ?? [];
    const ended = countWhile(spans, (span) => (span.to ?? Infinity) < from);
    const begun = countWhile(spans, (span) => span.from <= to);
    return spans.slice(Math.max(0, ended - 16), begun);
  }

  /**
   * The lanes to show: of those with one of some words in a name, all if there is room, otherwise those with spans in a
   * range [ms].
   * @param words separated by spaces or commas; without any, all lanes count
   * @param room [px]
   */
  shown({ from, to }: { from: number; to: number }, words: string, room: number) {
    const wanted = words
      .toLowerCase()
      .split(/[\s,]+/)
      .filter(Boolean);
    const isWanted = (lane: StateNode) => [lane, ...lane.children].some(({ path }) => isNamed(path, wanted));
    const lanes = wanted.length ? this.all.filter(isWanted) : this.all;
    if (this.totalOf(lanes) <= room) return lanes;
    return lanes.filter((lane) => this.spansIn(lane, from, to).some((span) => (span.to ?? Infinity) >= from));
  }
}

/** Whether the name of a state contains one of some words. */
const isNamed = (path: string, words: string[]) => {
  const name = path.slice(path.lastIndexOf("/") + 1).toLowerCase();
  return words.some((word) => name.includes(word));
};
