// Pan and zoom by pointer, keys and animation.

import type { Box, Point } from "#core/types.ts";

const LEAST_SCALE = 0.04;
const MOST_SCALE = 4;
const HEAD = 30; // height that a banner covers [px]
const MARGIN = 16; // around all of the machine [px]

/** translation [px] and scale */
export type View = { x: number; y: number; k: number };

export class Viewport {
  svg: SVGSVGElement;
  world: SVGElement;
  onChange: () => void;
  reducedMotion: MediaQueryList;
  x = 0;
  y = 0;
  k = 1;
  moved = false; // whether the last press of the pointer moved the view
  #animation = 0;

  constructor(svg: SVGSVGElement, world: SVGElement, onChange: () => void) {
    this.svg = svg;
    this.world = world;
    this.onChange = onChange;
    this.reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
    svg.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    grab(svg, {
      onPress: () => {
        this.moved = false;
      },
      onPan: (dx, dy) => {
        this.moved = true;
        this.pan(dx, dy);
      },
      onZoom: (factor, px, py) => this.zoom(factor, px, py),
    });
  }

  get width() {
    return this.svg.clientWidth || 1;
  }
  get height() {
    return this.svg.clientHeight || 1;
  }

  /** Width divided by height of the room for a machine: in a low view the margins take much of it. */
  get aspect() {
    return Math.max(1, this.width - 2 * MARGIN) / Math.max(1, this.height - HEAD - 2 * MARGIN);
  }

  set(x: number, y: number, k: number) {
    Object.assign(this, { x, y, k });
    this.onChange(); // before the diagram is moved: it asks for sizes, which would lay all of it out once more
    this.world.setAttribute("transform", `translate(${x} ${y}) scale(${k})`);
  }

  /** Show all of a box. */
  frame(
    box: Box,
    { margin = MARGIN, most = 1.6, animate = true }: { margin?: number; most?: number; animate?: boolean } = {},
  ): View {
    const room = this.height - HEAD;
    const k = Math.min(most, (this.width - 2 * margin) / box.w, (room - 2 * margin) / box.h);
    const x = (this.width - box.w * k) / 2 - box.x * k;
    const y = HEAD + (room - box.h * k) / 2 - box.y * k;
    if (animate) this.animateTo(x, y, k);
    else this.set(x, y, k);
    return { x, y, k };
  }

  is({ x, y, k }: View) {
    return Math.abs(x - this.x) + Math.abs(y - this.y) < 1 && Math.abs(k - this.k) < 1e-3;
  }

  /** The scale at which a box fills the view. */
  scaleFor(box: Box, margin = MARGIN) {
    return Math.min((this.width - 2 * margin) / box.w, (this.height - 2 * margin) / box.h);
  }

  animateTo(x: number, y: number, k: number, time = 380) {
    cancelAnimationFrame(this.#animation);
    if (this.reducedMotion.matches) {
      this.set(x, y, k);
      return;
    }
    const from = { x: this.x, y: this.y, k: this.k };
    const begun = performance.now();
    const step = (now: number) => {
      // The time of a frame can be before the call that began the animation.
      const part = Math.max(0, Math.min(1, (now - begun) / time));
      const ease = 1 - (1 - part) ** 3;
      this.set(from.x + (x - from.x) * ease, from.y + (y - from.y) * ease, from.k + (k - from.k) * ease);
      if (part < 1) this.#animation = requestAnimationFrame(step);
    };
    this.#animation = requestAnimationFrame(step);
  }

  zoom(factor: number, px = this.width / 2, py = this.height / 2) {
    cancelAnimationFrame(this.#animation);
    const k = Math.max(LEAST_SCALE, Math.min(MOST_SCALE, this.k * factor));
    this.set(px - ((px - this.x) * k) / this.k, py - ((py - this.y) * k) / this.k, k);
  }

  pan(dx: number, dy: number) {
    cancelAnimationFrame(this.#animation);
    this.set(this.x + dx, this.y + dy, this.k);
  }

  /** @param y of the diagram */
  centre(x: number, y: number) {
    this.set(this.width / 2 - x * this.k, this.height / 2 - y * this.k, this.k);
  }

  #wheel(e: WheelEvent) {
    e.preventDefault();
    const box = this.svg.getBoundingClientRect();
    const pixels = e.deltaMode ? e.deltaY * 16 : e.deltaY;
    this.zoom(Math.exp(-pixels * 0.0016), e.clientX - box.left, e.clientY - box.top);
  }
}

/**
 * Follow the pointer until it is released or cancelled.
 * @param isMine of several pointers
 */
export function drag(
  onMove: (e: PointerEvent) => void,
  onEnd?: (e: PointerEvent) => void,
  isMine: (e: PointerEvent) => boolean = () => true,
) {
  const end = (e: PointerEvent) => {
    if (!isMine(e)) return;
    removeEventListener("pointermove", onMove);
    removeEventListener("pointerup", end);
    removeEventListener("pointercancel", end);
    onEnd?.(e);
  };
  addEventListener("pointermove", onMove);
  addEventListener("pointerup", end);
  addEventListener("pointercancel", end);
}

const STILL = 4; // a press with less movement is a tap [px]

/**
 * Pan an element's content with one pointer, pan and zoom it with two.
 * @param handlers `onTap`: pressed and released without movement
 */
export function grab(
  element: Element,
  {
    onPress,
    onPan,
    onZoom,
    onTap,
  }: {
    onPress?: () => void;
    onPan: (dx: number, dy: number) => void;
    onZoom: (factor: number, px: number, py: number) => void;
    onTap?: (pressed: PointerEvent) => void;
  },
) {
  const pointers: Map<number, Point> = new Map(); // the pressed pointers, by id
  let moved = false;
  const grip = () => {
    const [a, b] = pointers.values();
    if (!b) return { ...a, wide: 0 };
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, wide: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  const down = (e: PointerEvent) => {
    if (e.button !== 0) return;
    pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    if (pointers.size === 1) {
      moved = false;
      onPress?.();
    }
    const isMine = (m: PointerEvent) => m.pointerId === e.pointerId;
    drag(
      (m) => {
        if (!isMine(m)) return;
        if (!moved && Math.hypot(m.clientX - e.clientX, m.clientY - e.clientY) < STILL) return;
        moved = true;
        element.classList.add("grabbed");
        const before = grip();
        pointers.set(e.pointerId, { x: m.clientX, y: m.clientY });
        const after = grip();
        onPan(after.x - before.x, after.y - before.y);
        const box = element.getBoundingClientRect();
        if (before.wide && after.wide) onZoom(after.wide / before.wide, after.x - box.left, after.y - box.top);
      },
      (m) => {
        pointers.delete(e.pointerId);
        if (pointers.size) return;
        element.classList.remove("grabbed");
        if (!moved && m.type === "pointerup") onTap?.(e);
      },
      isMine,
    );
  };
  element.addEventListener("pointerdown", (e) => down(e as PointerEvent));
}
