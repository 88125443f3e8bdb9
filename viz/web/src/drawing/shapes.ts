// The shapes in which a container can be laid out, and how well a layout fills the view.

import type { Link, StateNode } from "#core/types.ts";
import { type ContainerLayout, DIRECTIONS, LEAF_H, leafWidth, SEP, type Shape } from "#drawing/placed.ts";

const GRID_FROM = 4; // children of a concurrence from which a grid is tried
const FOLD_FROM = { closed: 5, open: 7 }; // the same of another container for folding, all closed or one open
const BUNDLE_FROM = 6; // states that lead to one outcome, from which they have no arrows of their own
const FOLD_COST = 1.05; // factor on the cost of a folded shape, because its lines are longer

export const nameOf = ({ dir, columns, folded }: Shape) => `${dir}${columns ?? ""}${folded ? "~" : ""}`;

/**
 * The shapes to try for a container.
 * @param inner the open containers in it
 */
export function shapesOf(node: StateNode, inner: Map<string, ContainerLayout>, aspect: number): Shape[] {
  const shapes: Shape[] = DIRECTIONS.map((dir) => ({ dir }));
  const { children } = node;
  if (node.kind !== "concurrence") {
    if (children.length >= (inner.size ? FOLD_FROM.open : FOLD_FROM.closed))
      shapes.push(...DIRECTIONS.map((dir) => ({ dir, folded: true })));
    return shapes;
  }
  if (children.length < GRID_FROM) return shapes;
  const sizes = children.map((child) => inner.get(child.label) ?? { w: leafWidth(child), h: LEAF_H });
  const size = (columns: number) => {
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

/** The cost by which shapes are compared. */
export const badness = (layout: ContainerLayout, aspect: number) =>
  cost(layout, aspect) * (layout.shape.folded ? FOLD_COST : 1);

/** How badly a layout fills a view of an aspect: the smaller, the better. */
export const cost = ({ w, h }: { w: number; h: number }, aspect: number) =>
  Math.max(w, aspect * h) + 0.15 * Math.sqrt(w * h);

/**
 * The transitions of many states that lead to one outcome by the same way, with their number: the outcome says it in
 * place of so many arrows.
 */
export function bundlesOf({ kind, links, children }: StateNode): Map<Link, number> {
  if (kind === "plan" || kind === "concurrence" || children.length < BUNDLE_FROM) return new Map();
  const groups = new Map<string, Link[]>();
  for (const link of links) {
    if (!link.to_outcome || link.join !== null || link.change || link.note) continue;
    const key = [link.target, ...link.outcomes].join(SEP);
    groups.set(key, [...(groups.get(key) ?? []), link]);
  }
  const bundles = [...groups.values()].filter((group) => group.length >= BUNDLE_FROM);
  return new Map(bundles.flatMap((group) => group.map((link) => [link, group.length])));
}

/** Whether a container has more arrows than that, altogether and for each state. */
export const hasOver = (node: StateNode, limit: { links: number; perState: number }) => {
  const drawn = node.links.length - bundlesOf(node).size;
  return drawn > limit.links && drawn > limit.perState * node.children.length;
};
