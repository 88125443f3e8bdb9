// The minimap: all states as spots, those that run lit, and a frame around the part in view. It keeps to a free corner.

import type { Box } from "#core/types.ts";
import type { Picture } from "#drawing/picture.ts";
import { el } from "#drawing/svg.ts";
import { drag, type Viewport } from "#drawing/viewport.ts";

const SHOWN_BELOW = 0.6; // shown if a smaller part of the machine is in view
const CORNERS = ["bottom-right", "bottom-left", "top-right", "top-left"];

export class Minimap {
  svg: SVGSVGElement;
  #size: Box | null = null; // of the machine
  #rects: Map<string, SVGElement> = new Map(); // by path
  #leaves: Box[] = []; // of the states that are not opened
  #due: Map<string, boolean> = new Map(); // changes to paint: path -> whether the state is active
  #window = el("rect", { class: "window" }); // the part in view

  /** @param onCentre called with the place in the diagram that was pressed */
  constructor(svg: SVGSVGElement, onCentre: (x: number, y: number) => void) {
    this.svg = svg;
    const move = (e: PointerEvent) => {
      const matrix = svg.getScreenCTM();
      if (!matrix) return;
      const { x, y } = new DOMPoint(e.clientX, e.clientY).matrixTransform(matrix.inverse());
      onCentre(x, y);
    };
    svg.addEventListener("pointerdown", (pressed) => {
      drag(move);
      move(pressed);
    });
  }

  draw({ size, boxes, states }: Picture) {
    if (!size) return;
    this.#size = size;
    this.#rects.clear();
    this.#due.clear();
    this.#leaves = [];
    this.svg.setAttribute("viewBox", `0 0 ${size.w} ${size.h}`);
    for (const [path, box] of boxes) {
      const isOpen = states.get(path)?.group.classList.contains("box");
      const place = { x: box.x, y: box.y, width: box.w, height: box.h, rx: 6 };
      this.#rects.set(path, el("rect", { class: isOpen ? "area" : "spot", ...place }));
      if (!isOpen) this.#leaves.push(box);
    }
    this.svg.replaceChildren(...this.#rects.values(), this.#window);
  }

  /** Light a state, or not, at the next painting. */
  light(path: string, active: boolean) {
    this.#due.set(path, active);
  }

  /** Paint what has changed; a few times a second, as doing it at every event costs as much as the rest. */
  paint() {
    for (const [path, active] of this.#due) this.#rects.get(path)?.classList.toggle("active", active);
    this.#due.clear();
  }

  /** Show which part is in view; if it is most of the machine, there is no minimap. */
  showWindow(view: Viewport) {
    if (!this.#size) return;
    const { x, y, k, width, height } = view;
    const { w, h } = this.#size;
    const own = { w: this.svg.clientWidth, h: this.svg.clientHeight };
    const place = { x: -x / k, y: -y / k, width: width / k, height: height / k };
    for (const [name, value] of Object.entries(place)) this.#window.setAttribute(name, String(value));
    this.#window.style.strokeWidth = `${Math.max(w, h) / 70}px`;
    const seen = (from: number, size: number, room: number) =>
      Math.max(0, Math.min(room, from + size * k) - Math.max(0, from)) / (size * k);
    const isIdle = seen(x, w, width) * seen(y, h, height) > SHOWN_BELOW;
    this.svg.classList.toggle("idle", isIdle);
    if (!isIdle) this.svg.setAttribute("data-corner", this.#freeCorner(view, own));
  }

  /** The corner of the view where the minimap covers the fewest states. @param own its size [px] */
  #freeCorner({ x, y, k, width, height }: Viewport, own: { w: number; h: number }) {
    const [w, h] = [own.w + 20, own.h + 20];
    const covered = Object.fromEntries(CORNERS.map((corner) => [corner, 0]));
    for (const box of this.#leaves) {
      const [left, top] = [box.x * k + x, box.y * k + y];
      const [right, bottom] = [left + box.w * k, top + box.h * k];
      for (const corner of CORNERS) {
        const atX = corner.endsWith("right") ? right > width - w && left < width : left < w && right > 0;
        const atY = corner.startsWith("bottom") ? bottom > height - h && top < height : top < h && bottom > 0;
        if (atX && atY) covered[corner] += 1;
      }
    }
    const now = this.svg.getAttribute("data-corner") ?? CORNERS[0];
    return CORNERS.reduce((best, one) => (covered[one] < covered[best] ? one : best), now);
  }
}
