// The timeline: a lane for each container, with a row for each branch of a concurrence; over them the stretch that is
// selected, outages, notes, and the instants at the pointer and shown.

import { ms } from "#core/fold.ts";
import type { Axis } from "#core/idle.ts";
import { store } from "#core/store.ts";
import { duration } from "#core/text.ts";
import { Bars, clipped } from "#drawing/bars.ts";
import { Lanes } from "#drawing/lanes.ts";
import { Colours, FONT, fitted } from "#drawing/theme.ts";
import { TimeWindow } from "#drawing/time_window.ts";
import { describe, drawFold, drawNotes, drawOutages } from "#drawing/timeline_marks.ts";
import { drag } from "#drawing/viewport.ts";

// Sizes in CSS pixels
const NAMES = 168; // width of the lanes' names
const NAMES_NARROW = 84; // on a narrow page
const TOOLS_NARROW = 176; // width of the buttons at the axis there
const RIGHT = 14;
const TOP = 3;
const FOOT = 26; // height of the axis and its buttons
const FLAG = "600 11px 'JetBrains Mono', ui-monospace, monospace";
const STEPS_S = [
  ...[0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5],
  ...[1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14_400],
];

export class Timeline {
  canvas: HTMLCanvasElement;
  context: CanvasRenderingContext2D;
  onPick: (path: string) => void;
  onDraw: (range: { from: number; to: number }) => void;
  window = new TimeWindow();
  lanes = new Lanes();
  bars: Bars;
  top = 0; // vertical scroll [px]
  names = NAMES; // width of the lanes' names [px]
  scale: Axis | null = null; // of the last drawing
  tallest = 0; // height of all lanes and the axis [px]
  gaps: [number, number][] = []; // outages [px]
  #colours = new Colours();

  constructor(
    canvas: HTMLCanvasElement,
    { onPick, onDraw }: { onPick: (path: string) => void; onDraw: (range: { from: number; to: number }) => void },
  ) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d") as CanvasRenderingContext2D;
    this.bars = new Bars(this.context, this.#colours);
    this.onPick = onPick;
    this.onDraw = onDraw;
    canvas.addEventListener("pointerdown", (e) => this.#down(e));
    canvas.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    canvas.addEventListener("pointermove", (e) => {
      const span = this.#spanAt(e);
      const fold = this.#foldAt(e);
      canvas.title = fold
        ? `nothing happened for ${duration((fold.to - fold.from) / 1000)}: click to unfold it`
        : span
          ? describe(span)
          : "";
      store.pointer.hover(span ? { path: span.path, from: span.from } : null);
      this.#hover(e.offsetX);
    });
    canvas.addEventListener("pointerleave", () => {
      this.#hover(null);
      store.pointer.hover(null);
    });
    canvas.addEventListener("keydown", (e) => this.#key(e));
    canvas.addEventListener("dblclick", (e) => {
      const span = this.#spanAt(e);
      if (!span) return;
      this.window.fit(span.from, span.to ?? store.playback.nowMs());
      this.draw();
    });
  }

  /** Read the colours again. */
  restyle() {
    this.#colours.forget();
  }

  reset() {
    this.window.reset();
    this.lanes.forget();
    this.top = 0;
  }

  /** Follow the present. */
  live() {
    this.window.end = null;
    store.playback.seek(null);
  }

  /** Tell screen readers the instant shown, as the value of a slider [s]. */
  tellInstant() {
    const began = store.playback.began() ?? 0;
    const seconds = (t: number) => String(Math.max(0, Math.round((t - began) / 1000)));
    this.canvas.setAttribute("aria-valuemin", "0");
    this.canvas.setAttribute("aria-valuemax", seconds(store.data.liveMs()));
    this.canvas.setAttribute("aria-valuenow", seconds(store.playback.nowMs()));
    this.canvas.setAttribute("aria-valuetext", store.clock.instantText(store.playback.nowMs()));
  }

  // -- drawing ----------------------------------------------------------------------------------

  draw() {
    const g = this.context;
    const model = store.data.model.value;
    const size = fitted(g);
    if (!size || !model) return;
    const { width, height } = size;
    const room = height - FOOT;
    this.names = width < 640 ? NAMES_NARROW : NAMES;
    g.clearRect(0, 0, width, height);
    g.font = FONT;
    g.textBaseline = "middle";
    this.window.keepInView();
    const scale = this.window.axis(this.names, width - RIGHT);
    const { from, to } = scale;
    this.scale = scale;
    this.#grid(scale, width, height);
    this.lanes.update(model, store.data.run.spans);
    this.#fitHeight();
    const lanes = this.lanes.shown(scale, store.view.laneFilter.value, room);
    this.top = Math.max(0, Math.min(this.top, this.lanes.totalOf(lanes) - room));
    let y = TOP - this.top;
    this.bars.forget();
    clipped(g, 0, 0, width, room, () => {
      for (const lane of lanes) {
        const tall = this.lanes.heightOf(lane);
        if (y + tall > 0 && y < room) this.bars.lane(lane, y, this.lanes, model, scale);
        y += tall;
      }
    });
    this.gaps = drawOutages(g, this.#colours, scale, room);
    for (const fold of scale.folds) drawFold(g, this.#colours, fold, scale, room);
    this.#stretch(scale, height);
    drawNotes(g, this.#colours, scale, room);
    this.#cursor(scale, height);
    this.onDraw({ from, to });
  }

  /** Tell the page the height of all lanes and the axis: more is left to the plots. */
  #fitHeight() {
    const tallest = TOP + this.lanes.totalOf(this.lanes.all) + FOOT;
    if (tallest === this.tallest) return;
    this.tallest = tallest;
    document.documentElement.style.setProperty("--lanes", `${tallest}px`);
  }

  #grid(axis: Axis, width: number, height: number) {
    const { from, to } = axis;
    const g = this.context;
    const first = store.data.run.first();
    if (first === null) return; // there are no instants before the first event
    const begun = ms(store.playback.shown().started) ?? first;
    const step =
      1000 * (STEPS_S.find((s) => s * 1000 * axis.rate > 74) ?? 86_400 * Math.ceil(74 / axis.rate / 86_400_000));
    g.fillStyle = this.#colours.of("muted");
    g.strokeStyle = this.#colours.of("hair");
    g.textAlign = "left";
    g.lineWidth = 1;
    const next = (t: number) => begun + Math.ceil((t - begun) / step) * step;
    const digits = Math.max(0, Math.ceil(3 - Math.log10(step)));
    const shown = store.playback.cursor.value;
    const flag = shown === null ? null : this.#flagBox(inside(axis, shown), shown);
    let free = this.names === NAMES_NARROW ? TOOLS_NARROW : 0; // where there is room for text
    for (let t = next(from); t < to; t += step) {
      const fold = axis.folds.find((one) => one.from < t && one.to > t);
      if (fold) t = next(fold.to);
      const px = Math.round(axis.x(t)) + 0.5;
      g.beginPath();
      g.moveTo(px, 0);
      g.lineTo(px, height - FOOT);
      g.stroke();
      const text = store.clock.instantText(t, digits);
      const end = px + 3 + g.measureText(text).width;
      const isCovered = flag !== null && px < flag.right && end > flag.left;
      if (t < first || px < free || end > width || isCovered) continue;
      g.fillText(text, px + 3, height - FOOT / 2);
      free = end + 4;
    }
  }

  /** Draw the selected stretch. */
  #stretch(axis: Axis, height: number) {
    const found = store.playback.stretch.value;
    if (!found) return;
    const g = this.context;
    const [left, right] = [found.from, found.to].map((t) => Math.max(axis.left, axis.x(t)));
    g.fillStyle = this.#colours.of("ink");
    g.globalAlpha = 0.1;
    g.fillRect(left, 0, right - left, height - FOOT);
    g.globalAlpha = 1;
    for (const px of [left, right]) g.fillRect(px - 0.75, 0, 1.5, height - FOOT);
    g.fillRect(left, height - FOOT, right - left, store.playback.looping.value ? 4 : 2);
  }

  /** Draw the instants at the pointer and shown. */
  #cursor(axis: Axis, height: number) {
    const at = store.playback.cursor.value;
    const pointed = store.pointer.pointed.value;
    if (pointed !== null && axis.x(pointed) >= axis.left) this.#flag(axis.x(pointed), pointed, height, "muted", 1);
    if (at !== null) this.#flag(inside(axis, at), at, height, "active", 2);
  }

  /** Draw a line through the lanes, with its instant at the axis. */
  #flag(px: number, t: number, height: number, colour: string, wide: number) {
    const g = this.context;
    const { left, right } = this.#flagBox(px, t);
    g.font = FLAG;
    g.fillStyle = this.#colours.of(colour);
    g.fillRect(px - wide / 2, 0, wide, height - FOOT);
    g.beginPath();
    g.roundRect(left, height - FOOT + 3, right - left, FOOT - 6, 4);
    g.fill();
    g.fillStyle = this.#colours.of("background");
    g.textAlign = "center";
    g.fillText(store.clock.instantText(t), (left + right) / 2, height - FOOT / 2 + 0.5);
    g.font = FONT;
  }

  /** The ends of the flag with an instant, at the axis [px]. */
  #flagBox(px: number, t: number) {
    this.context.font = FLAG;
    const half = this.context.measureText(store.clock.instantText(t)).width / 2 + 5;
    this.context.font = FONT;
    const middle = Math.max(this.names + half, Math.min(this.canvas.clientWidth - half, px));
    return { left: middle - half, right: middle + half };
  }

  // -- input ------------------------------------------------------------------------------------

  #timeAt(px: number) {
    return this.window.axis(this.names, this.canvas.clientWidth - RIGHT).timeAt(px);
  }

  #hover(px: number | null) {
    store.pointer.pointed.value = px !== null && px >= this.names ? this.#timeAt(px) : null;
  }

  #spanAt(e: MouseEvent) {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [e.clientX - box.left, e.clientY - box.top];
    const hit = this.bars.hits.findLast((h) => px >= h.left - 1 && px <= h.right + 1 && py >= h.top && py <= h.bottom);
    return hit?.span ?? null;
  }

  /** The folded idle time below the pointer; null for none, and at the axis. */
  #foldAt(e: MouseEvent) {
    return e.offsetY < this.canvas.clientHeight - FOOT ? (this.scale?.foldAt(e.offsetX) ?? null) : null;
  }

  #down(e: PointerEvent) {
    const { left, bottom } = this.canvas.getBoundingClientRect();
    const from = e.clientX - left;
    if (e.button !== 0 || from < this.names) return;
    const selects = e.pointerType === "mouse" && e.clientY < bottom - FOOT; // other drags move the instant shown
    const begin = this.#timeAt(from);
    const span = this.#spanAt(e);
    const fold = this.#foldAt(e);
    let dragged = false;
    this.window.hold();
    const seek = (m: PointerEvent) =>
      store.playback.seek(Math.min(this.#timeAt(m.clientX - left), store.data.run.last() ?? Infinity));
    const move = (m: PointerEvent) => {
      if (Math.abs(m.clientX - left - from) > 3) dragged = true;
      if (dragged && selects) store.playback.selectStretch(begin, this.#timeAt(m.clientX - left));
      else if (dragged || (!span && !selects)) seek(m);
    };
    drag(move, (m) => {
      if (dragged && selects) return;
      if (!dragged && fold) {
        store.clock.unfold(fold);
        return;
      }
      seek(m);
      if (!dragged && span) this.onPick(span.path);
    });
  }

  #wheel(e: WheelEvent) {
    e.preventDefault();
    if (e.shiftKey || (!e.ctrlKey && e.deltaX === 0 && e.offsetX < this.names)) this.top += e.deltaY || e.deltaX;
    else this.#zoom(e);
    this.draw();
  }

  #zoom(e: WheelEvent) {
    if (Math.abs(e.deltaX) > Math.abs(e.deltaY)) this.window.move(e.deltaX / this.canvas.clientWidth);
    else this.window.zoom(Math.exp(e.deltaY * 0.0016), this.#timeAt(e.offsetX));
  }

  #key(e: KeyboardEvent) {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 }[e.key];
    if (step !== undefined) {
      store.playback.seekEvent(step);
      e.stopPropagation();
    } else if (e.key === "End") this.live();
    else if (e.key === "Home") store.playback.seek(store.data.run.first());
    else return;
    e.preventDefault();
  }
}

/** The place of an instant on an axis, at an end of it for one outside of its range [px]. */
const inside = (axis: Axis, t: number) => Math.max(axis.left, Math.min(axis.right, axis.x(t)));
