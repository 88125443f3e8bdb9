// The layout of a machine with too many open states for arrows: nested tiles.

import type { StateNode } from "#core/types.ts";
import { measure } from "#drawing/measure.ts";
import { type ContainerLayout, isOpen, LEAF_H, leafWidth } from "#drawing/placed.ts";
import { cost } from "#drawing/shapes.ts";

const TILE_GAP = 6;
const HEAD = 24; // height of the name of a tile
const HEAD_GROWS = 1.7; // factor for the name of each further level out
const MOST_COLUMNS = 60;

/**
 * The layout of a machine with too many open states for arrows: nested tiles in the order of the machine, so that a
 * state is always at the same place.
 */
export function overview(node: StateNode, open: Set<string>, aspect: number): ContainerLayout {
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
 * @param head room for the name
 * @param least width
 */
function inRows(
  tiles: { node: StateNode; inner: ContainerLayout | null; w: number; h: number }[],
  columns: number,
  head: number,
  least: number,
) {
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
