// The lanes of the timeline: one for each container in which a state has run, with the spans of its states.

import { countWhile } from "#core/lists.ts";
import type { Model } from "#core/model.ts";
import type { Span, StateNode } from "#core/types.ts";

// Sizes in CSS pixels
const LANE = 19;
const ROW = 13;
const MOST_ROWS = 8; // rows of a concurrence

export class Lanes {
  all: StateNode[] = []; // in the order of the tree
  #spansOf: Map<string, Span[]> = new Map(); // by path of the lane
  #model: Model | null = null;
  #spans: Span[] | null = null;
  #sorted = 0; // number of spans that are in lanes

  forget() {
    this.#model = null;
  }

  /** Put new spans into lanes; a container gets a lane when a state in it has run. */
  update(model: Model, spans: Span[]) {
    if (this.#model !== model || this.#spans !== spans) {
      // another machine, another run, or spans were dropped
      this.#spansOf.clear();
      this.#sorted = 0;
      this.all = [];
    }
    this.#model = model;
    this.#spans = spans;
    const before = this.#spansOf.size;
    for (; this.#sorted < spans.length; this.#sorted++) {
      const span = spans[this.#sorted];
      const lane = model.get(span.path)?.parent?.path;
      if (lane === undefined) continue;
      const known = this.#spansOf.get(lane);
      if (known) known.push(span);
      else this.#spansOf.set(lane, [span]);
    }
    if (this.#spansOf.size !== before) this.all = model.order.filter((node) => this.#spansOf.has(node.path));
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
    if (heightOf(lanes) <= room) return lanes;
    return lanes.filter((lane) => this.spansIn(lane, from, to).some((span) => (span.to ?? Infinity) >= from));
  }
}

/** Whether the name of a state contains one of some words. */
const isNamed = (path: string, words: string[]) => {
  const name = path.slice(path.lastIndexOf("/") + 1).toLowerCase();
  return words.some((word) => name.includes(word));
};

/** The number of a lane's rows. */
export const rowsOf = (lane: StateNode) => (lane.kind === "concurrence" ? lane.children.length : 1);

/** [px] */
export const laneHeight = (lane: StateNode) =>
  lane.kind === "concurrence" ? Math.max(LANE, ROW * Math.min(lane.children.length, MOST_ROWS) + 3) : LANE;

export const heightOf = (lanes: StateNode[]) => lanes.reduce((sum, lane) => sum + laneHeight(lane), 0);
