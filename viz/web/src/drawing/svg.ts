// SVG elements, and the few shapes that the diagram is made of.

import type { Point } from "#core/types.ts";

const NS = "http://www.w3.org/2000/svg";

const ICONS: Record<string, string> = {
  // in a box of 10 x 10
  action: "M2 1.2 8.6 5 2 8.8Z",
  service: "M1 3.4h7M6 1.2 8.4 3.4 6 5.6M9 6.8H2M4 4.6 1.6 6.8 4 9",
  monitor: "M5 1a4 4 0 1 0 0 8a4 4 0 1 0 0-8M5 3.4a1.6 1.6 0 1 0 0 3.2a1.6 1.6 0 1 0 0-3.2",
  condition: "M5 .8 9.2 5 5 9.2 .8 5Z",
  callback: "M4 5a1 1 0 1 0 2 0a1 1 0 1 0-2 0",
  state: "M4 5a1 1 0 1 0 2 0a1 1 0 1 0-2 0",
  machine: "M1 1.5h8v7H1ZM1 4h8",
  sequence: "M1 5h7M6 2.6 8.6 5 6 7.4",
  concurrence: "M3 1v8M7 1v8",
  iterator: "M8.4 5a3.4 3.4 0 1 1-1.2-2.6M8.6 .8v2.4H6.2",
  missing: "M2 2l6 6M8 2 2 8",
};
const STROKED = new Set(["service", "machine", "sequence", "concurrence", "iterator", "missing", "condition"]);

export function el(
  name: string,
  attributes: Record<string, string | number | null | undefined> = {},
  ...children: (Node | string)[]
): SVGElement {
  const made = document.createElementNS(NS, name) as SVGElement;
  for (const [key, value] of Object.entries(attributes)) if (value != null) made.setAttribute(key, String(value));
  made.append(...children);
  return made;
}

/** @param kind of a state */
export const icon = (kind: string, x: number, y: number) =>
  el("path", {
    d: ICONS[kind] ?? ICONS.state,
    transform: `translate(${x} ${y})`,
    class: `icon ${STROKED.has(kind) ? "stroked" : ""}`,
  });

/** The path of a line with rounded corners. */
export function roundedLine(points: Point[], radius = 6) {
  const at = (p: Point) => `${p.x.toFixed(1)} ${p.y.toFixed(1)}`;
  let d = `M${at(points[0])}`;
  for (let i = 1; i < points.length - 1; i++) {
    const [a, b, c] = [points[i - 1], points[i], points[i + 1]];
    const before = Math.hypot(b.x - a.x, b.y - a.y);
    const after = Math.hypot(c.x - b.x, c.y - b.y);
    const r = Math.min(radius, before / 2, after / 2);
    if (r < 0.5) {
      d += `L${at(b)}`;
      continue;
    }
    const from = { x: b.x + ((a.x - b.x) / before) * r, y: b.y + ((a.y - b.y) / before) * r };
    const to = { x: b.x + ((c.x - b.x) / after) * r, y: b.y + ((c.y - b.y) / after) * r };
    d += `L${at(from)}Q${at(b)} ${at(to)}`;
  }
  return `${d}L${at(points[points.length - 1])}`;
}

/** The middle of the longest part of a line. */
export function middleOfLongest(points: Point[]): Point {
  let best = { x: points[0].x, y: points[0].y, length: -1 };
  for (let i = 1; i < points.length; i++) {
    const [a, b] = [points[i - 1], points[i]];
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    if (length > best.length) best = { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, length };
  }
  return best;
}

/** The heads of the arrows, one for each class of outcomes. */
export function arrowHeads() {
  const heads = ["success", "failure", "preempted", "other", "plain"].map((kind) =>
    el(
      "marker",
      {
        id: `arrow-${kind}`,
        class: `arrow ${kind}`,
        viewBox: "0 0 10 10",
        refX: 9,
        refY: 5,
        markerWidth: 6.5,
        markerHeight: 6.5,
        markerUnits: "userSpaceOnUse",
        orient: "auto-start-reverse",
      },
      el("path", { d: "M0 1 10 5 0 9Z" }),
    ),
  );
  return el("defs", {}, ...heads);
}
