// The layout of a concurrence of many closed branches: a grid of cards in the order of the machine, and one bracket at
// its right from which the arrows of all its rules lead.

import { joinText } from "#core/model.ts";
import { shorten } from "#core/text.ts";
import type { Box, Direction, Link, StateNode } from "#core/types.ts";
import { measure } from "#drawing/measure.ts";
import type { ContainerLayout, PlacedEdge } from "#drawing/placed.ts";

const CARD = { w: 136, h: 52 };
const GAP = 8;
const HEAD = 28; // height of the container's name
const SIDE = 14;
const BRACKET = 6; // thickness
const ARM = 5; // of the bracket, above and below
const PILL_H = 15;
const ENTRY = 10;
const MOST_COLUMNS = 12;

/** One arrow from the bracket: a rule, or the transitions to one outcome. */
type Way = Pick<PlacedEdge, "link" | "join" | "source" | "outcomes" | "also"> & { outcome: string; text: string };

const pillWidth = (outcome: string) => measure(shorten(outcome), 9, true) + 15;

/** The arrows of a concurrence, one for each rule and each outcome. */
export function waysOf(node: StateNode): Way[] {
  const ways: Way[] = node.joins.map((join) => ({
    ...{ join, source: node.path, outcomes: [join.outcome], outcome: join.outcome },
    text: joinText(join, join.need - 1),
  }));
  const byTarget = new Map<string, Link[]>();
  for (const link of node.links) {
    if (!link.to_outcome || link.join !== null) continue;
    byTarget.set(link.target, [...(byTarget.get(link.target) ?? []), link]);
  }
  for (const [outcome, links] of byTarget) {
    const also = links.map((link) => ({ source: `${node.path}/${link.source}`, outcomes: link.outcomes }));
    const [{ source, outcomes }] = also;
    const text = links.length > 1 ? `any of ${links.length}` : `${links[0].source}: ${outcomes.join(", ")}`;
    ways.push({ link: links[0], source, outcomes, also, outcome, text: shorten(text) });
  }
  return ways;
}

/**
 * Lay out a concurrence as cards.
 * @param outer direction of the container around it; null for the root
 * @param aspect of the view
 */
export function cards(node: StateNode, outer: Direction | null, aspect: number): ContainerLayout {
  const count = node.children.length;
  const sizeOf = (columns: number) => {
    const w = columns * (CARD.w + GAP) - GAP;
    const h = Math.ceil(count / columns) * (CARD.h + GAP) - GAP;
    return { columns, w, h, cost: Math.max(w + 120, aspect * (h + 50)) };
  };
  const tried = Array.from({ length: Math.min(MOST_COLUMNS, count) }, (_, i) => sizeOf(i + 1));
  const grid = tried.reduce((a, b) => (b.cost < a.cost ? b : a));
  const boxes = node.children.map((child, i) => ({
    x: SIDE + (i % grid.columns) * (CARD.w + GAP),
    y: HEAD + Math.floor(i / grid.columns) * (CARD.h + GAP),
    ...CARD,
    ...{ node: child, inner: null, hasRows: false, nameWidth: 0, dots: [], card: true },
  }));
  const bracket = { x: SIDE + grid.w + 8, y: HEAD - ARM, w: BRACKET, h: grid.h + 2 * ARM };
  const ways = waysOf(node);
  const from = bracket.x + BRACKET;
  const longest = Math.max(0, ...ways.map((way) => measure(way.text, 9, true)));
  const pills: (Box & { outcome: string })[] = [];
  const edges: PlacedEdge[] = [];
  const outcomes = [...new Set(ways.map((way) => way.outcome))];
  let w = from + SIDE;
  const h = HEAD + grid.h + (outer === "DOWN" ? 34 : 20);
  const heightOf = (i: number) => HEAD + ((i + 0.5) * grid.h) / ways.length;
  const lanes = new Map<string, { x: number; y: number; ways: number[] }>();
  for (const [i, way] of ways.entries()) {
    const known = lanes.get(way.outcome);
    if (known) known.ways.push(i);
    else lanes.set(way.outcome, { x: 0, y: heightOf(i), ways: [i] });
  }
  let lane = from + longest + 24;
  for (const outcome of outcomes) {
    const at = lanes.get(outcome);
    if (!at) continue;
    const wide = pillWidth(outcome);
    at.x = outer === "DOWN" ? lane + wide / 2 : lane;
    lane += outer === "DOWN" ? wide + 12 : 10;
  }
  if (ways.length)
    w = outer === "DOWN" ? lane : lane + 14 + (outer === null ? Math.max(...outcomes.map(pillWidth)) : 0);
  for (const [outcome, at] of lanes) {
    const wide = pillWidth(outcome) + (outer === null ? 4 : 0);
    const pill =
      outer === "DOWN"
        ? { x: at.x - wide / 2, y: h - PILL_H / 2, w: wide, h: PILL_H }
        : { x: outer === null ? w - wide - SIDE / 2 : w - wide / 2, y: at.y - PILL_H / 2, w: wide, h: PILL_H };
    pills.push({ ...pill, outcome });
    for (const i of at.ways) {
      const y = heightOf(i);
      const corner = { x: at.x, y };
      const end = outer === "DOWN" ? { x: at.x, y: pill.y } : { x: pill.x, y: at.y };
      const points = outer !== "DOWN" && y !== at.y ? [corner, { x: at.x, y: at.y }] : outer === "DOWN" ? [corner] : [];
      const { link, join, source, outcomes: its, also, text } = ways[i];
      edges.push({
        ...{ kind: "link", link, join, source, outcomes: its, also },
        points: [{ x: from, y }, ...points, end],
        labels: [{ x: from + 8 + measure(text, 9, true) / 2, y: y - 14, text }],
      });
    }
  }
  const entry = outer === "DOWN" ? { x: SIDE + 6, y: 0 } : outer === "RIGHT" ? { x: 0, y: HEAD / 2 } : null;
  const ports = pills.map((pill) => ({ ...pill, entry: false }));
  return {
    ...{ node, shape: { dir: "DOWN", columns: grid.columns, cards: true }, w, h, boxes, pills, edges, entry },
    joins: ways.length ? [{ ...bracket, join: node.joins[0] ?? null }] : [],
    ports: entry
      ? [...ports, { x: entry.x - ENTRY / 2, y: entry.y - ENTRY / 2, w: ENTRY, h: ENTRY, entry: true, outcome: "" }]
      : [],
  };
}
