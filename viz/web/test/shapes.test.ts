import "./browser.ts";
import assert from "node:assert/strict";
import { test } from "node:test";
import type { StateNode } from "#core/types.ts";
import type { ContainerLayout } from "#drawing/placed.ts";
import { cost, nameOf, shapesOf } from "#drawing/shapes.ts";
import { Viewport } from "#drawing/viewport.ts";
import { Shape } from "./browser.ts";

const machine = (count: number) =>
  ({
    kind: "machine",
    children: Array.from({ length: count }, () => ({ children: [], shown: "GO" })),
  }) as unknown as StateNode;
const shapes = (count: number) => shapesOf(machine(count), new Map(), 2).map(nameOf);

test("a machine of five states is tried as lines, too: one line of them is small in most views", () => {
  assert.deepEqual(shapes(4), ["DOWN", "RIGHT"]);
  assert.deepEqual(shapes(5), ["DOWN", "RIGHT", "DOWN~", "RIGHT~"]);
  const open = new Map([["GO", { w: 200, h: 200 } as ContainerLayout]]);
  assert.deepEqual(shapesOf(machine(5), open, 2).map(nameOf), ["DOWN", "RIGHT"]);
});

/** A view of a size. */
function view(clientWidth: number, clientHeight: number) {
  Object.assign(globalThis, { matchMedia: () => ({ matches: true }) });
  const svg = Object.assign(new Shape("svg"), { clientWidth, clientHeight, addEventListener: () => {} });
  return new Viewport(svg as unknown as SVGSVGElement, new Shape("g") as unknown as SVGElement, () => {});
}

test("of two drawings the one with the larger scale costs less, in a low view and in a tall one", () => {
  const [upright, level] = [
    { w: 318, h: 545 },
    { w: 1325, h: 169 },
  ];
  const scale = (one: Viewport, { w, h }: { w: number; h: number }) =>
    one.frame({ x: 0, y: 0, w, h }, { animate: false }).k;
  for (const one of [view(788, 215), view(390, 600)]) {
    const isLarger = scale(one, level) > scale(one, upright);
    assert.equal(cost(level, one.aspect) < cost(upright, one.aspect), isLarger);
  }
  assert.ok(scale(view(788, 215), level) > scale(view(788, 215), upright));
});
