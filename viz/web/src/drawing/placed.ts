// The layout of a container: the places of its parts, and how it was laid out.

import { shorten } from "#core/text.ts";
import type { Box, Direction, Join, Link, Point, StateNode } from "#core/types.ts";
import { measure } from "#drawing/measure.ts";

export type PlacedPort = Box & { entry: boolean; outcome: string };
export type PlacedPill = Box & { outcome: string; from?: number }; // number of states that lead there, without arrows
/** a state, with a row for each of its outcomes or without */
export type PlacedBox = Box & {
  node: StateNode;
  inner: ContainerLayout | null;
  hasRows: boolean;
  nameWidth: number;
  dots: (Point & { outcome: string })[];
  card?: boolean; // a branch of a concurrence of many
};
export type PlacedJoin = Box & { join: Join | null }; // null: the bracket of single rules
export type PlacedEdge = {
  kind: "link" | "initial" | "fork";
  link?: Link;
  join?: Join;
  source: string;
  outcomes: string[];
  also?: { source: string; outcomes: string[] }[]; // more transitions that it stands for
  points: Point[];
  labels: (Point & { text: string })[];
};
/** places of the parts of a container, relative to its corner */
export type ContainerLayout = {
  node: StateNode;
  shape: Shape;
  w: number;
  h: number;
  boxes: PlacedBox[];
  pills: PlacedPill[];
  joins: PlacedJoin[];
  ports: PlacedPort[];
  edges: PlacedEdge[];
  entry: Point | null;
  isOverview?: boolean;
  head?: number;
};
/** how a container is laid out: along a
 * direction, in a grid with a number of columns, or folded like a long line of text */
export type Shape = { dir: Direction; columns?: number; folded?: boolean; cards?: boolean };
/** ids to connect a state by */
export type Ends = { entry: string; out: (outcome?: string) => string; split: boolean };

export const SEP = "\u0001";
export const LEAF_H = 26;
export const DIRECTIONS: Direction[] = ["DOWN", "RIGHT"];

export const pillWidth = (outcome: string) => measure(shorten(outcome), 9, true) + 15;

export function leafWidth(node: StateNode) {
  const closed = node.children.length ? 20 + measure(String(node.total - 1), 9) : 0;
  return Math.max(56, 44 + measure(node.shown, 11, true) + closed);
}

/** The boxes of all drawn states, by path. */
export function boxesOf(layout: ContainerLayout, x: number = 0, y: number = 0, found = new Map() as Map<string, Box>) {
  found.set(layout.node.path, { x, y, w: layout.w, h: layout.h });
  for (const { node, inner, ...box } of layout.boxes)
    if (inner) boxesOf(inner, x + box.x, y + box.y, found);
    else found.set(node.path, { x: x + box.x, y: y + box.y, w: box.w, h: box.h });
  return found;
}

/** Whether a container is drawn with its states. */
export const isOpen = (node: StateNode, open: Set<string>) => node.children.length > 0 && open.has(node.path);

/** What an id in a graph stands for. */
export type Meaning =
  | { kind: "entry" | "port" | "hidden" }
  | { kind: "open"; child: StateNode; inner: ContainerLayout }
  | { kind: "leaf"; child: StateNode; hasRows: boolean; nameWidth: number }
  | { kind: "dot"; outcome: string }
  | { kind: "pill"; outcome: string; from?: number }
  | { kind: "join"; join: Join }
  | EdgeMeaning;
export type EdgeMeaning = Pick<PlacedEdge, "kind" | "link" | "join" | "source" | "outcomes">;
