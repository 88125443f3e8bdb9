// Pan and zoom: at the pointer, by keys, by animation; events never move the view.

const LEAST_SCALE = 0.04;
const MOST_SCALE = 4;
const HEAD = 18; // [px] that a banner covers

/** @typedef {{ x: number, y: number, k: number }} View translation [px] and scale */

export class Viewport {
  x = 0;
  y = 0;
  k = 1;
  moved = false; // whether the last press of the pointer moved the view
  #animation = 0;
  /** @type {Map<number, Point>} */
  #pointers = new Map(); // that are down, by their number

  /** @param {SVGSVGElement} svg @param {SVGElement} world @param {() => void} onChange */
  constructor(svg, world, onChange) {
    this.svg = svg;
    this.world = world;
    this.onChange = onChange;
    this.reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
    svg.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    svg.addEventListener("pointerdown", (e) => this.#down(e));
  }

  get width() {
    return this.svg.clientWidth || 1;
  }
  get height() {
    return this.svg.clientHeight || 1;
  }

  /** @param {number} x @param {number} y @param {number} k */
  set(x, y, k) {
    Object.assign(this, { x, y, k });
    this.world.setAttribute("transform", `translate(${x} ${y}) scale(${k})`);
    this.onChange();
  }

  /**
   * Show all of a box.
   * @param {Box} box
   * @param {{ margin?: number, most?: number, animate?: boolean }} [options]
   * @returns {View}
   */
  frame(box, { margin = 28, most = 1.6, animate = true } = {}) {
    const room = this.height - HEAD;
    const k = Math.min(most, (this.width - 2 * margin) / box.w, (room - 2 * margin) / box.h);
    const x = (this.width - box.w * k) / 2 - box.x * k;
    const y = HEAD + (room - box.h * k) / 2 - box.y * k;
    if (animate) this.animateTo(x, y, k);
    else this.set(x, y, k);
    return { x, y, k };
  }

  /** @param {View} view */
  is({ x, y, k }) {
    return Math.abs(x - this.x) + Math.abs(y - this.y) < 1 && Math.abs(k - this.k) < 1e-3;
  }

  /** The scale at which a box fills the view. @param {Box} box */
  scaleFor(box, margin = 28) {
    return Math.min((this.width - 2 * margin) / box.w, (this.height - 2 * margin) / box.h);
  }

  /** @param {number} x @param {number} y @param {number} k */
  animateTo(x, y, k, time = 380) {
    cancelAnimationFrame(this.#animation);
    if (this.reducedMotion.matches) {
      this.set(x, y, k);
      return;
    }
    const from = { x: this.x, y: this.y, k: this.k };
    const begun = performance.now();
    const step = (/** @type {number} */ now) => {
      const part = Math.max(0, Math.min(1, (now - begun) / time)); // a frame may have begun before
      const ease = 1 - (1 - part) ** 3;
      this.set(from.x + (x - from.x) * ease, from.y + (y - from.y) * ease, from.k + (k - from.k) * ease);
      if (part < 1) this.#animation = requestAnimationFrame(step);
    };
    this.#animation = requestAnimationFrame(step);
  }

  /** @param {number} factor */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    cancelAnimationFrame(this.#animation);
    const k = Math.max(LEAST_SCALE, Math.min(MOST_SCALE, this.k * factor));
    this.set(px - ((px - this.x) * k) / this.k, py - ((py - this.y) * k) / this.k, k);
  }

  /** @param {number} dx @param {number} dy */
  pan(dx, dy) {
    cancelAnimationFrame(this.#animation);
    this.set(this.x + dx, this.y + dy, this.k);
  }

  /** @param {number} x @param {number} y of the diagram */
  centre(x, y) {
    this.set(this.width / 2 - x * this.k, this.height / 2 - y * this.k, this.k);
  }

  /** @param {WheelEvent} e */
  #wheel(e) {
    e.preventDefault();
    const box = this.svg.getBoundingClientRect();
    const pixels = e.deltaMode ? e.deltaY * 16 : e.deltaY;
    this.zoom(Math.exp(-pixels * 0.0016), e.clientX - box.left, e.clientY - box.top);
  }

  /** One pointer moves the view, two zoom it as well. @param {PointerEvent} e */
  #down(e) {
    if (e.button !== 0) return;
    this.#pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    if (this.#pointers.size === 1) this.moved = false;
    const begun = { x: e.clientX, y: e.clientY };
    const isMine = (/** @type {PointerEvent} */ m) => m.pointerId === e.pointerId;
    drag(
      (m) => {
        if (!isMine(m)) return;
        if (!this.moved && Math.hypot(m.clientX - begun.x, m.clientY - begun.y) < 4) return;
        this.moved = true;
        this.svg.classList.add("grabbed");
        const before = this.#grip();
        this.#pointers.set(e.pointerId, { x: m.clientX, y: m.clientY });
        const after = this.#grip();
        this.pan(after.x - before.x, after.y - before.y);
        const box = this.svg.getBoundingClientRect();
        if (before.wide && after.wide) this.zoom(after.wide / before.wide, after.x - box.left, after.y - box.top);
      },
      () => {
        this.#pointers.delete(e.pointerId);
        if (!this.#pointers.size) this.svg.classList.remove("grabbed");
      },
      isMine,
    );
  }

  /** The middle between the pointers, and how far they are from each other. */
  #grip() {
    const [a, b] = this.#pointers.values();
    if (!b) return { ...a, wide: 0 };
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, wide: Math.hypot(a.x - b.x, a.y - b.y) };
  }
}

/**
 * Follow the pointer until it is let go, or taken away.
 * @param {(e: PointerEvent) => void} onMove
 * @param {(e: PointerEvent) => void} [onEnd]
 * @param {(e: PointerEvent) => boolean} [isMine] of several pointers
 */
export function drag(onMove, onEnd, isMine = () => true) {
  const end = (/** @type {PointerEvent} */ e) => {
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
