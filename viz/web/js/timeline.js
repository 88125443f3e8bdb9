// The run over time: a lane per container, a lane for each region of a concurrence; drag to wind.
import * as store from "viewer/store";
import { outcomeClass } from "viewer/model";
import { askerText, ms } from "viewer/fold";

const NAMES = 168, NARROW = 84, RIGHT = 14, FOOT = 18, LANE = 19, LEAST_SPAN = 0.5, LIVE_SPAN = 30_000;

export class Timeline {
  constructor(canvas, { onPick }) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.width = LIVE_SPAN; // [ms] shown
    this.end = null; // [ms]; null: with now
    this.top = 0;
    this.names = NAMES; // [px] for the names of the lanes
    this.onPick = onPick;
    this.colours = null;
    this.lanes = [];
    canvas.addEventListener("pointerdown", (e) => this.#down(e));
    canvas.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    canvas.addEventListener("pointermove", (e) => { this.hover = this.#at(e); });
    canvas.addEventListener("pointerleave", () => { this.hover = null; });
    canvas.addEventListener("keydown", (e) => this.#key(e));
  }

  restyle() { this.colours = null; }
  reset() { this.end = null; this.width = LIVE_SPAN; this.top = 0; this.lanes = []; this.known = null; }
  fitAll() {
    const first = store.run.first(), last = store.nowMs();
    if (first == null) return;
    this.width = Math.max(500, (last - first) * 1.04);
    this.end = last + this.width * 0.02;
  }

  #colour(name) {
    if (!this.colours) {
      const style = getComputedStyle(document.documentElement);
      this.colours = new Proxy({}, { get: (all, key) => (all[key] ??= style.getPropertyValue(`--${key}`).trim()) });
    }
    return this.colours[name];
  }

  #range() {
    const now = store.nowMs();
    let end = this.end ?? now + this.width * 0.01;
    if (store.cursor.value !== null && this.end === null) end = Math.max(now + this.width / 2, now);
    const first = store.run.first(); // a young run begins at the left and grows
    if (store.cursor.value === null && this.end === null && first != null) end = Math.max(end, first + this.width * 0.98);
    return [end - this.width, end];
  }

  #time(px) {
    const [from, to] = this.#range();
    return from + ((px - this.names) / (this.canvas.clientWidth - this.names - RIGHT)) * (to - from);
  }

  // Lanes in tree order; made again when a container shows up for the first time.
  #makeLanes(model, spans) {
    const key = `${model.root.path} ${spans.length}`;
    if (this.known === key && this.model === model && this.spans === spans) return;
    const before = this.byPath;
    if (this.model !== model || !before) { this.byPath = new Map(); this.seen = 0; this.containers = new Set(); }
    if (this.spans !== spans) { this.byPath = new Map(); this.seen = 0; this.containers = new Set(); this.spans = spans; } // another run, or a shorter one
    for (; this.seen < spans.length; this.seen++) {
      const span = spans[this.seen];
      const node = model.get(span.path);
      if (!node) continue;
      const lane = node.parent?.path ?? "";
      if (!lane) continue;
      this.containers.add(lane);
      (this.byPath.get(lane) ?? this.byPath.set(lane, []).get(lane)).push(span);
    }
    this.known = key;
    this.model = model;
    this.lanes = model.order.filter((n) => this.containers.has(n.path));
  }

  draw() {
    const { canvas, context: g } = this;
    const model = store.model.value;
    const width = canvas.clientWidth, height = canvas.clientHeight, ratio = devicePixelRatio || 1;
    if (!width || !model) return;
    this.names = width < 640 ? NARROW : NAMES;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    g.font = "11px Inter, Arial, sans-serif";
    g.textBaseline = "middle";
    this.#makeLanes(model, store.run.spans);
    const [from, to] = this.#range();
    const x = (t) => this.names + ((t - from) / (to - from)) * (width - this.names - RIGHT);
    this.#grid(g, x, from, to, width, height);
    const room = height - FOOT;
    const lanes = this.#lanesToShow(from, to, room);
    const all = lanes.reduce((sum, lane) => sum + this.#laneHeight(lane), 0);
    this.top = Math.max(0, Math.min(this.top, all - room));
    let y = 3 - this.top;
    g.save();
    g.beginPath(); g.rect(0, 0, width, room); g.clip();
    this.hits = [];
    for (const lane of lanes) {
      const h = this.#laneHeight(lane);
      if (y + h > 0 && y < room) this.#lane(g, lane, y, h, x, from, to, width);
      y += h;
    }
    g.restore();
    this.#cursor(g, x, width, height);
  }

  // All lanes where there is room, else those with something in them.
  #lanesToShow(from, to, room) {
    const tall = this.lanes.reduce((sum, lane) => sum + this.#laneHeight(lane), 0);
    if (tall <= room) return this.lanes;
    return this.lanes.filter((lane) => {
      const spans = this.byPath.get(lane.path) ?? [];
      for (let i = firstAfter(spans, from); i < spans.length && spans[i].from <= to; i++)
        if ((spans[i].to ?? Infinity) >= from) return true;
      return false;
    });
  }

  #laneHeight(lane) { return lane.kind === "concurrence" ? Math.max(LANE, 13 * Math.min(lane.children.length, 6) + 3) : LANE; }

  #grid(g, x, from, to, width, height) {
    const begun = ms(store.shown().started) ?? store.run.first() ?? from;
    const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 7200].map((s) => s * 1000);
    const step = steps.find((s) => (s / (to - from)) * (width - this.names) > 74) ?? 14_400_000;
    g.fillStyle = this.#colour("muted");
    g.strokeStyle = this.#colour("hair");
    g.textAlign = "left";
    g.lineWidth = 1;
    for (let t = begun + Math.ceil((from - begun) / step) * step; t < to; t += step) {
      const px = Math.round(x(t)) + 0.5;
      g.beginPath(); g.moveTo(px, 0); g.lineTo(px, height - FOOT); g.stroke();
      g.fillText(clock((t - begun) / 1000), px + 3, height - FOOT / 2);
    }
  }

  #lane(g, lane, y, h, x, from, to, width) {
    g.fillStyle = this.#colour("muted");
    g.textAlign = "left";
    const indent = 10 + Math.min(lane.depth, 6) * 9;
    g.save(); g.beginPath(); g.rect(0, y, this.names - 8, h); g.clip();
    g.fillText(lane.name, indent, y + h / 2);
    g.restore();
    const regions = lane.kind === "concurrence" ? lane.children.length : 1;
    const spans = this.byPath.get(lane.path) ?? [];
    const now = store.nowMs();
    let lastPx = -10;
    for (let i = firstAfter(spans, from); i < spans.length; i++) {
      const span = spans[i];
      if (span.from > to) break;
      const later = span.from > now; // the future of an earlier instant
      const ended = span.to !== null && (later || span.to <= now);
      const until = span.to !== null ? span.to : Math.max(now, store.run.last() ?? now);
      if (until < from) continue;
      const a = Math.max(this.names, x(span.from)), b = Math.min(width - RIGHT + 2, x(until));
      if (regions === 1 && b - lastPx < LEAST_SPAN && ended) continue; // too thin to see
      lastPx = b;
      const node = this.model.get(span.path);
      const row = regions > 1 ? lane.children.indexOf(node) : 0;
      const top = y + 1.5 + (row * (h - 3)) / regions;
      const tall = (h - 3) / regions - (regions > 1 ? 1.5 : 0);
      g.globalAlpha = later ? 0.35 : 1;
      this.#bar(g, span, node, ended, a, Math.max(2, b - a), top, tall, x, later ? Infinity : now);
      g.globalAlpha = 1;
    }
  }

  #bar(g, span, node, ended, a, wide, top, tall, x, now) {
    const kind = ended ? outcomeClass(span.outcome) : span.preempt && span.preempt <= now ? "preempted" : "active";
    g.fillStyle = this.#colour(`${kind}-fill`);
    g.strokeStyle = this.#colour(kind);
    g.lineWidth = store.selected.value === span.path ? 2.2 : 1.1;
    g.beginPath();
    g.roundRect(a, top, wide, tall, Math.min(4, tall / 2, wide / 2));
    g.fill();
    if (span.preempt && span.preempt <= now) { // the time from the request to the end
      const from = Math.max(a, x(span.preempt));
      g.save(); g.clip();
      g.fillStyle = this.#colour("preempted");
      g.globalAlpha *= 0.55;
      for (let p = from; p < a + wide; p += 5) g.fillRect(p, top, 2.5, tall);
      g.restore();
    }
    g.stroke();
    for (const [t, name] of [[span.serviced, "preempted"], [span.abandoned, "failure"]]) { // taken up, left behind
      if (t === null || t > now) continue;
      g.fillStyle = this.#colour(name);
      g.beginPath();
      const px = Math.min(x(t), a + wide);
      g.moveTo(px - 3.5, top - 1); g.lineTo(px + 3.5, top - 1); g.lineTo(px, top + 5); g.fill();
      g.fillRect(px - 0.75, top, 1.5, tall);
    }
    this.hits.push({ a, b: a + wide, top, bottom: top + tall, span });
    if (wide > 26 && tall > 8) {
      g.fillStyle = this.#colour(`${kind}-text`);
      g.font = `${tall > 13 ? 11 : 9.5}px Inter, Arial, sans-serif`;
      g.textAlign = "left";
      g.save(); g.beginPath(); g.rect(a, top, wide - 3, tall); g.clip();
      g.fillText(node.name, a + 4, top + tall / 2 + 0.5);
      g.restore();
      g.font = "11px Inter, Arial, sans-serif";
    }
  }

  #cursor(g, x, width, height) {
    const at = store.cursor.value;
    if (at === null) return;
    const px = x(at);
    g.strokeStyle = this.#colour("active");
    g.lineWidth = 2;
    g.beginPath(); g.moveTo(px, 0); g.lineTo(px, height - FOOT); g.stroke();
    g.fillStyle = this.#colour("active");
    g.beginPath(); g.moveTo(px - 6, 0); g.lineTo(px + 6, 0); g.lineTo(px, 8); g.fill();
  }

  #at(e) {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [e.clientX - box.left, e.clientY - box.top];
    const hit = (this.hits ?? []).findLast((h) => px >= h.a - 1 && px <= h.b + 1 && py >= h.top && py <= h.bottom);
    this.canvas.title = hit ? describe(hit.span) : "";
    return hit?.span ?? null;
  }

  #down(e) {
    const box = this.canvas.getBoundingClientRect();
    const px = e.clientX - box.left;
    if (px < this.names) return;
    const span = this.#at(e);
    const from = px;
    let dragged = false;
    const [start, stop] = this.#range();
    if (this.end === null) this.end = stop;
    const wind = (m) => {
      const here = m.clientX - box.left;
      if (Math.abs(here - from) > 3) dragged = true;
      if (dragged || !span) store.seek(Math.min(this.#time(here), store.run.last() ?? stop));
    };
    const up = (m) => {
      removeEventListener("pointermove", wind);
      removeEventListener("pointerup", up);
      if (!dragged && span) { store.seek(Math.min(this.#time(m.clientX - box.left), store.run.last())); this.onPick(span.path); }
      else wind(m);
    };
    addEventListener("pointermove", wind);
    addEventListener("pointerup", up);
    void start;
  }

  #wheel(e) {
    e.preventDefault();
    if (e.shiftKey || (!e.ctrlKey && e.deltaX === 0 && e.offsetX < this.names)) { this.top += e.deltaY; return; }
    const [from, to] = this.#range();
    const at = this.#time(e.offsetX);
    if (Math.abs(e.deltaX) > Math.abs(e.deltaY)) {
      this.end = to + (e.deltaX / this.canvas.clientWidth) * this.width;
      return;
    }
    const factor = Math.exp(e.deltaY * 0.0016);
    const width = Math.max(200, Math.min(this.width * factor, 30 * 86_400_000));
    if (this.end !== null || store.cursor.value !== null) this.end = at + ((to - at) * width) / this.width;
    this.width = width;
    void from;
  }

  #key(e) {
    const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 };
    if (e.key in steps) { store.seekEvent(steps[e.key]); e.preventDefault(); e.stopPropagation(); }
    else if (e.key === "End") { this.live(); e.preventDefault(); }
    else if (e.key === "Home") { store.seek(store.run.first()); e.preventDefault(); }
  }

  live() { this.end = null; store.seek(null); }
}

const firstAfter = (spans, from) => { // spans begin in order; long ones may have begun long before
  let low = 0, high = spans.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if ((spans[mid].to ?? Infinity) < from) low = mid + 1; else high = mid;
  }
  return Math.max(0, low - 16);
};
const clock = (s) => {
  const sign = s < -0.0005 ? "-" : "", v = Math.abs(s);
  if (v < 60) return `${sign}${+v.toFixed(1)} s`;
  return `${sign}${Math.floor(v / 60)}:${String(Math.floor(v % 60)).padStart(2, "0")}`;
};
const describe = (span) => {
  const lasted = span.to === null ? "runs" : `${((span.to - span.from) / 1000).toFixed(3)} s, ${span.outcome}`;
  const after = (t) => `${((t - span.preempt) / 1000).toFixed(3)} s later`;
  const asked = span.preempt === null ? [] : [`asked to stop ${((span.preempt - span.from) / 1000).toFixed(3)} s after it began, by ${askerText(span.asked) ?? "?"}`,
    span.serviced !== null && `taken up ${after(span.serviced)}`, span.abandoned !== null && `left behind ${after(span.abandoned)}`];
  return [span.path, lasted, ...asked].filter(Boolean).join("\n");
};
