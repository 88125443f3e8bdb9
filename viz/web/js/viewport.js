// Pan and zoom: at the cursor, by keys, by flights; events never move it.
const LEAST = 0.04, MOST = 4;
const FOOT = 22, HEAD = 18; // what the legend and a banner cover

export class Viewport {
  constructor(svg, world, onChange) {
    Object.assign(this, { svg, world, onChange, x: 0, y: 0, k: 1, flight: 0, moved: false });
    this.calm = matchMedia("(prefers-reduced-motion: reduce)");
    svg.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    svg.addEventListener("pointerdown", (e) => this.#down(e));
  }
  get width() { return this.svg.clientWidth || 1; }
  get height() { return this.svg.clientHeight || 1; }

  set(x, y, k) {
    Object.assign(this, { x, y, k });
    this.world.setAttribute("transform", `translate(${x} ${y}) scale(${k})`);
    this.onChange();
  }
  frame(box, { margin = 28, most = 1.6, fly = true } = {}) {
    const room = this.height - FOOT - HEAD;
    const k = Math.min(most, (this.width - 2 * margin) / box.w, (room - 2 * margin) / box.h);
    const x = (this.width - box.w * k) / 2 - box.x * k;
    const y = HEAD + (room - box.h * k) / 2 - box.y * k;
    if (fly) this.fly(x, y, k); else this.set(x, y, k);
    return { x, y, k };
  }
  is({ x, y, k }) { return Math.abs(x - this.x) + Math.abs(y - this.y) < 1 && Math.abs(k - this.k) < 1e-3; }
  scaleFor(box, margin = 28) {
    return Math.min((this.width - 2 * margin) / box.w, (this.height - 2 * margin) / box.h);
  }
  fly(x, y, k, time = 380) {
    cancelAnimationFrame(this.flight);
    if (this.calm.matches) { this.set(x, y, k); return; }
    const from = { x: this.x, y: this.y, k: this.k }, begun = performance.now();
    const step = (now) => {
      const part = Math.min(1, (now - begun) / time), ease = 1 - (1 - part) ** 3;
      this.set(from.x + (x - from.x) * ease, from.y + (y - from.y) * ease, from.k + (k - from.k) * ease);
      if (part < 1) this.flight = requestAnimationFrame(step);
    };
    this.flight = requestAnimationFrame(step);
  }
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    cancelAnimationFrame(this.flight);
    const k = Math.max(LEAST, Math.min(MOST, this.k * factor));
    this.set(px - ((px - this.x) * k) / this.k, py - ((py - this.y) * k) / this.k, k);
  }
  pan(dx, dy) { cancelAnimationFrame(this.flight); this.set(this.x + dx, this.y + dy, this.k); }
  centre(x, y) { this.set(this.width / 2 - x * this.k, this.height / 2 - y * this.k, this.k); }
  #wheel(e) {
    e.preventDefault();
    const box = this.svg.getBoundingClientRect();
    const pixels = e.deltaMode ? e.deltaY * 16 : e.deltaY;
    this.zoom(Math.exp(-pixels * 0.0016), e.clientX - box.left, e.clientY - box.top);
  }
  #down(e) {
    if (e.button !== 0) return;
    let { clientX: x, clientY: y } = e;
    this.moved = false;
    const move = (m) => {
      if (!this.moved && Math.hypot(m.clientX - x, m.clientY - y) < 4) return;
      this.moved = true;
      this.svg.classList.add("grabbed");
      this.pan(m.clientX - x, m.clientY - y);
      ({ clientX: x, clientY: y } = m);
    };
    const up = () => {
      removeEventListener("pointermove", move);
      removeEventListener("pointerup", up);
      this.svg.classList.remove("grabbed");
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", up);
  }
}
