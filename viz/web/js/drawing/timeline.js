// The timeline: a lane for each container, with a row for each branch of a concurrence.
import { ms } from "#core/fold.js";
import { countWhile } from "#core/lists.js";
import { endClass } from "#core/outcomes.js";
import { COLOURS } from "#core/scene.js";
import * as store from "#core/store.js";
import { askerText, duration } from "#core/text.js";
import { Colours, fitted } from "#drawing/theme.js";
import { drag } from "#drawing/viewport.js";

// Sizes in CSS pixels
const NAMES = 168; // width of the lanes' names
const NAMES_NARROW = 84; // on a narrow page
const RIGHT = 14;
const FOOT = 26; // height of the axis and its buttons
const LANE = 19;
const ROW = 13;
const MOST_ROWS = 8; // rows of a concurrence
const NOTE = 130; // width of a note's text
const THINNEST = 0.5;
const LIVE_MS = 30_000; // shown at first
const SHORTEST_MS = 200; // the shortest time that can fill the timeline
const LONGEST_MS = 30 * 86_400_000;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14_400];

/** @typedef {import("#core/model.js").Model} Model */
/** @typedef {{ from: number, to: number, x: (t: number) => number }} Scale the range shown [ms], and its pixels */
/** @typedef {{ left: number, right: number, top: number, bottom: number, span: Span }} Hit */

export class Timeline {
  length = LIVE_MS; // shown [ms]
  /** @type {number | null} */
  end = null; // of the range shown [ms]; null: now
  top = 0; // vertical scroll [px]
  names = NAMES;
  /** @type {Scale | null} */
  scale = null; // of the last drawing
  tallest = 0; // height of all lanes and the axis [px]
  /** @type {StateNode[]} */
  lanes = []; // in the order of the tree
  /** @type {Map<string, Span[]>} */
  spansOf = new Map(); // by path of the lane
  /** @type {Model | null} */
  model = null;
  /** @type {Span[] | null} */
  spans = null;
  sorted = 0; // number of spans that are in lanes
  /** @type {Hit[]} */
  hits = [];
  /** @type {[number, number][]} */
  gaps = []; // outages [px]
  #colours = new Colours();

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ onPick: (path: string) => void, onDraw: (range: { from: number, to: number }) => void }} handlers
   */
  constructor(canvas, { onPick, onDraw }) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    this.onPick = onPick;
    this.onDraw = onDraw;
    canvas.addEventListener("pointerdown", (e) => this.#down(e));
    canvas.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    canvas.addEventListener("pointermove", (e) => {
      const span = this.#spanAt(e);
      canvas.title = span ? describe(span) : "";
      store.hover(span ? { path: span.path, from: span.from } : null);
      this.#hover(e.offsetX);
    });
    canvas.addEventListener("pointerleave", () => {
      this.#hover(null);
      store.hover(null);
    });
    canvas.addEventListener("keydown", (e) => this.#key(e));
    canvas.addEventListener("dblclick", (e) => {
      const span = this.#spanAt(e);
      if (span) this.#show(span.from, span.to ?? store.nowMs());
    });
  }

  /** Read the colours again. */
  restyle() {
    this.#colours.forget();
  }

  reset() {
    this.end = null;
    this.length = LIVE_MS;
    this.top = 0;
    this.model = null;
  }

  /** Show the whole run. */
  fitAll() {
    const first = store.run.first();
    const last = store.nowMs();
    if (first == null) return;
    this.length = Math.max(500, (last - first) * 1.04);
    this.end = last + this.length * 0.02;
  }

  /** Show a visit with some time around it. @param {number} from @param {number} to [ms] */
  #show(from, to) {
    const length = Math.max(SHORTEST_MS, (to - from) * 1.1);
    this.end = (from + to) / 2 + length / 2;
    this.length = length;
    this.draw();
  }

  /** Follow the present. */
  live() {
    this.end = null;
    store.seek(null);
  }

  /** The range shown [ms]. @returns {[number, number]} */
  #range() {
    const now = store.nowMs();
    let end = this.end ?? now + this.length * 0.01;
    if (this.end === null && store.cursor.value !== null) end = now + this.length / 2;
    const first = store.run.first(); // a run shorter than the range begins at the left
    if (this.end === null && store.cursor.value === null && first != null)
      end = Math.max(end, first + this.length * 0.98);
    return [end - this.length, end];
  }

  /** Keep the played instant in view. */
  #keepInView() {
    const at = store.cursor.value;
    if (this.end === null || at === null || !store.playing.value) return;
    if (at > this.end - 0.02 * this.length) this.end = at + 0.8 * this.length;
    else if (at < this.end - this.length) this.end = at + 0.95 * this.length;
  }

  /** @param {number} px */
  #timeAt(px) {
    const [from, to] = this.#range();
    return from + ((px - this.names) / (this.canvas.clientWidth - this.names - RIGHT)) * (to - from);
  }

  /**
   * Put new spans into lanes; a container gets a lane when a state in it has run.
   * @param {Model} model
   * @param {Span[]} spans
   */
  #makeLanes(model, spans) {
    if (this.model !== model || this.spans !== spans) {
      // another machine, another run, or spans were dropped
      this.spansOf.clear();
      this.sorted = 0;
      this.lanes = [];
    }
    this.model = model;
    this.spans = spans;
    const before = this.spansOf.size;
    for (; this.sorted < spans.length; this.sorted++) {
      const span = spans[this.sorted];
      const lane = model.get(span.path)?.parent?.path;
      if (lane === undefined) continue;
      const known = this.spansOf.get(lane);
      if (known) known.push(span);
      else this.spansOf.set(lane, [span]);
    }
    if (this.spansOf.size !== before) this.lanes = model.order.filter((node) => this.spansOf.has(node.path));
  }

  draw() {
    const g = this.context;
    const model = store.model.value;
    const size = fitted(g);
    if (!size || !model) return;
    const { width, height } = size;
    this.names = width < 640 ? NAMES_NARROW : NAMES;
    g.clearRect(0, 0, width, height);
    g.font = "11px Inter, Arial, sans-serif";
    g.textBaseline = "middle";
    this.#makeLanes(model, store.run.spans);
    this.#keepInView();
    const [from, to] = this.#range();
    const x = (/** @type {number} */ t) => this.names + ((t - from) / (to - from)) * (width - this.names - RIGHT);
    const scale = { from, to, x };
    this.scale = scale;
    this.#grid(scale, width, height);
    const tallest = this.lanes.reduce((sum, lane) => sum + laneHeight(lane), 3) + FOOT;
    if (tallest !== this.tallest) {
      this.tallest = tallest; // not higher than its lanes, to leave room for the plots
      document.documentElement.style.setProperty("--lanes", `${tallest}px`);
    }
    const room = height - FOOT;
    const lanes = this.#lanesToShow(scale, room);
    const all = lanes.reduce((sum, lane) => sum + laneHeight(lane), 0);
    this.top = Math.max(0, Math.min(this.top, all - room));
    let y = 3 - this.top;
    this.hits = [];
    this.#clipped(0, 0, width, room, () => {
      for (const lane of lanes) {
        const tall = laneHeight(lane);
        if (y + tall > 0 && y < room) this.#lane(lane, y, tall, scale, width);
        y += tall;
      }
    });
    this.#outages(scale, width, room);
    this.#stretch(x, height);
    this.#notes(x, width, height);
    this.#cursor(x, height);
    this.onDraw({ from, to });
  }

  /** Draw the selected stretch. @param {(t: number) => number} x @param {number} height */
  #stretch(x, height) {
    const found = store.stretch.value;
    if (!found) return;
    const g = this.context;
    const [left, right] = [found.from, found.to].map((t) => Math.max(this.names, x(t)));
    g.fillStyle = this.#colours.of("ink");
    g.globalAlpha = 0.1;
    g.fillRect(left, 0, right - left, height - FOOT);
    g.globalAlpha = 1;
    for (const px of [left, right]) g.fillRect(px - 0.75, 0, 1.5, height - FOOT);
    g.fillRect(left, height - FOOT, right - left, store.looping.value ? 4 : 2);
  }

  /** Draw the outages. @param {Scale} scale @param {number} width @param {number} height */
  #outages({ from, to, x }, width, height) {
    const g = this.context;
    this.gaps = [];
    for (const [begin, end] of store.run.now.outages ?? []) {
      if (end / 1e6 < from || begin / 1e6 > to) continue;
      const left = Math.max(this.names, x(begin / 1e6));
      const right = Math.min(width - RIGHT, Math.max(x(end / 1e6), left + 3));
      if (right <= left) continue;
      this.gaps.push([left, right]);
      g.fillStyle = this.#colours.of("background");
      g.fillRect(left, 0, right - left, height);
      g.strokeStyle = this.#colours.of("waiting");
      g.lineWidth = 1.5;
      g.setLineDash([2, 3]);
      for (const px of [left, right]) {
        g.beginPath();
        g.moveTo(px, 0);
        g.lineTo(px, height);
        g.stroke();
      }
      g.setLineDash([]);
      const text = duration((end - begin) / 1e9);
      if (g.measureText(text).width + 8 > right - left) continue;
      g.fillStyle = this.#colours.of("waiting-text");
      g.textAlign = "center";
      g.fillText(text, (left + right) / 2, 10);
    }
  }

  /**
   * Draw a pin at each note, with its text.
   * @param {(t: number) => number} x @param {number} width @param {number} height
   */
  #notes(x, width, height) {
    const g = this.context;
    for (const { at, text } of store.notes.value) {
      const px = x(at);
      if (px < this.names || px > width - RIGHT) continue;
      g.fillStyle = this.#colours.of("ink");
      g.fillRect(px - 0.5, 0, 1, height - FOOT);
      const wide = Math.min(NOTE, g.measureText(text).width + 10);
      const left = px + wide > width - RIGHT ? px - wide : px;
      const top = height - FOOT - 16;
      g.beginPath();
      g.roundRect(left, top, wide, 15, 3);
      g.fill();
      g.fillStyle = this.#colours.of("background");
      g.textAlign = "left";
      this.#clipped(left, top, wide - 4, 15, () => g.fillText(text, left + 5, top + 8));
    }
  }

  /** @param {number} x @param {number} y @param {number} w @param {number} h @param {() => void} paint */
  #clipped(x, y, w, h, paint) {
    const g = this.context;
    g.save();
    g.beginPath();
    g.rect(x, y, w, h);
    g.clip();
    paint();
    g.restore();
  }

  /** All lanes if there is room, otherwise those with spans in the range. @param {Scale} scale @param {number} room */
  #lanesToShow({ from, to }, room) {
    const tall = this.lanes.reduce((sum, lane) => sum + laneHeight(lane), 0);
    if (tall <= room) return this.lanes;
    return this.lanes.filter((lane) => {
      const spans = this.spansOf.get(lane.path) ?? [];
      for (let i = firstAfter(spans, from); i < spans.length && spans[i].from <= to; i++)
        if ((spans[i].to ?? Infinity) >= from) return true;
      return false;
    });
  }

  /** @param {Scale} scale @param {number} width @param {number} height */
  #grid({ from, to, x }, width, height) {
    const g = this.context;
    const begun = ms(store.shown().started) ?? store.run.first() ?? from;
    const widthOf = (/** @type {number} */ s) => ((s * 1000) / (to - from)) * (width - this.names);
    const step = 1000 * (STEPS_S.find((s) => widthOf(s) > 74) ?? 86_400 * Math.ceil((to - from) / 86_400_000 / 8));
    g.fillStyle = this.#colours.of("muted");
    g.strokeStyle = this.#colours.of("hair");
    g.textAlign = "left";
    g.lineWidth = 1;
    for (let t = begun + Math.ceil((from - begun) / step) * step; t < to; t += step) {
      const px = Math.round(x(t)) + 0.5;
      g.beginPath();
      g.moveTo(px, 0);
      g.lineTo(px, height - FOOT);
      g.stroke();
      const instant = store.instantText(t);
      const text = step < 1000 ? instant : instant.slice(0, -2);
      if (px + 3 + g.measureText(text).width < width) g.fillText(text, px + 3, height - FOOT / 2);
    }
  }

  /** @param {StateNode} lane @param {number} y @param {number} h @param {Scale} scale @param {number} width */
  #lane(lane, y, h, { from, to, x }, width) {
    const g = this.context;
    g.fillStyle = this.#colours.of("muted");
    g.textAlign = "left";
    const indent = 10 + Math.min(lane.depth, 6) * 9;
    this.#clipped(0, y, this.names - 8, h, () => g.fillText(lane.name, indent, y + h / 2));
    const rows = lane.kind === "concurrence" ? lane.children.length : 1;
    const spans = this.spansOf.get(lane.path) ?? [];
    const now = store.nowMs();
    let lastPx = -10;
    for (let i = firstAfter(spans, from); i < spans.length; i++) {
      const span = spans[i];
      if (span.from > to) break;
      const later = span.from > now; // after the instant shown
      const ended = span.to !== null && (later || span.to <= now);
      const until = span.to ?? Math.max(now, store.run.last() ?? now);
      const node = this.model?.get(span.path);
      if (until < from || !node) continue;
      const left = Math.max(this.names, x(span.from));
      const right = Math.min(width - RIGHT + 2, x(until));
      if (rows === 1 && right - lastPx < THINNEST && ended) continue; // too thin to see
      lastPx = right;
      const row = rows > 1 ? lane.children.indexOf(node) : 0;
      const pitch = (h - 3) / rows;
      const top = y + 1.5 + row * pitch;
      // Of very many branches each bar is a line, and the lines overlap.
      const tall = Math.max(1, pitch - (rows > 1 ? Math.min(1.5, pitch / 4) : 0));
      const hit = { left, right: left + Math.max(2, right - left), top, bottom: top + tall, span };
      g.globalAlpha = later ? 0.35 : 1;
      this.#bar(hit, node, ended, x, later ? Infinity : now);
      g.globalAlpha = 1;
      this.hits.push(hit);
    }
  }

  /**
   * @param {Hit} hit
   * @param {StateNode} node
   * @param {boolean} ended
   * @param {(t: number) => number} x
   * @param {number} now the instant shown [ms]; later parts are pale
   */
  #bar({ left, right, top, bottom, span }, node, ended, x, now) {
    const g = this.context;
    const [wide, tall] = [right - left, bottom - top];
    const asked = span.preempt !== null && span.preempt <= now ? span.preempt : null;
    const kind = ended ? endClass(node, span.outcome) : asked !== null ? "preempted" : "active";
    g.fillStyle = this.#colours.of(`${kind}-fill`);
    g.strokeStyle = this.#colours.of(kind);
    g.lineWidth = 1.1;
    g.beginPath();
    g.roundRect(left, top, wide, tall, Math.min(4, tall / 2, wide / 2));
    g.fill();
    if (asked !== null) {
      // hatch the time from the request to the end
      g.save();
      g.clip();
      g.fillStyle = this.#colours.of("preempted");
      g.globalAlpha *= 0.55;
      for (let px = Math.max(left, x(asked)); px < right; px += 5) g.fillRect(px, top, 2.5, tall);
      g.restore();
    }
    g.stroke();
    if (store.selected.value === span.path) {
      g.strokeStyle = this.#colours.of("ink"); // as in the diagram, and different from a running state
      g.lineWidth = 2;
      g.strokeRect(left - 1, top - 1, wide + 2, tall + 2);
    }
    const driver = store.scene.colourOf(span.path);
    if (driver >= 0) {
      g.fillStyle = this.#colours.of(`s${1 + (driver % COLOURS)}`); // of its track on the map
      g.fillRect(left + 2, bottom - 4, Math.max(0, wide - 4), 2.5);
    }
    const lit = store.hovered.value;
    if (lit?.path === span.path && lit.from === span.from) this.#halo({ left, right, top, bottom });
    this.#mark(span.serviced, "preempted", x, now, { right, top, tall });
    this.#mark(span.abandoned, "failure", x, now, { right, top, tall });
    if (wide <= 26 || tall <= 9) return;
    g.fillStyle = this.#colours.of(`${kind}-text`);
    g.font = `${tall > 13 ? 11 : 9.5}px Inter, Arial, sans-serif`;
    g.textAlign = "left";
    this.#clipped(left, top, wide - 3, tall, () => g.fillText(node.name, left + 4, top + tall / 2 + 0.5));
    g.font = "11px Inter, Arial, sans-serif";
  }

  /** Draw a ring around the visit that the pointer is on here or in the map. @param {Omit<Hit, "span">} bar */
  #halo({ left, right, top, bottom }) {
    const g = this.context;
    for (const [name, wide] of /** @type {[string, number][]} */ ([
      ["ink", 4.5],
      ["halo", 2.5],
    ])) {
      g.strokeStyle = this.#colours.of(name);
      g.lineWidth = wide;
      g.beginPath();
      g.roundRect(left - 1, top - 1, right - left + 2, bottom - top + 2, 4);
      g.stroke();
    }
  }

  /**
   * Mark the instant at which a preempt was serviced or the state was abandoned.
   * @param {number | null} t
   * @param {string} colour
   * @param {(t: number) => number} x
   * @param {number} now
   * @param {{ right: number, top: number, tall: number }} bar
   */
  #mark(t, colour, x, now, { right, top, tall }) {
    if (t === null || t > now) return;
    const g = this.context;
    const px = Math.min(x(t), right);
    g.fillStyle = this.#colours.of(colour);
    g.beginPath();
    g.moveTo(px - 3.5, top - 1);
    g.lineTo(px + 3.5, top - 1);
    g.lineTo(px, top + 5);
    g.fill();
    g.fillRect(px - 0.75, top, 1.5, tall);
  }

  /** @param {number | null} px */
  #hover(px) {
    store.pointed.value = px !== null && px >= this.names ? this.#timeAt(px) : null;
  }

  /** Draw the instants at the pointer and shown. @param {(t: number) => number} x @param {number} height */
  #cursor(x, height) {
    const at = store.cursor.value;
    const pointed = store.pointed.value;
    if (pointed !== null && x(pointed) >= this.names) this.#flag(x(pointed), pointed, height, "muted", 1);
    if (at === null) return;
    const last = this.canvas.clientWidth - RIGHT;
    const px = Math.max(this.names, Math.min(last, x(at))); // outside the range it is drawn at the edge
    this.#flag(px, at, height, "active", 2);
  }

  /**
   * Draw a line through the lanes, with its instant at the axis.
   * @param {number} px @param {number} t @param {number} height @param {string} colour @param {number} wide
   */
  #flag(px, t, height, colour, wide) {
    const g = this.context;
    const text = store.instantText(t);
    g.font = "600 11px 'JetBrains Mono', ui-monospace, monospace";
    const half = g.measureText(text).width / 2 + 5;
    const middle = Math.max(this.names + half, Math.min(this.canvas.clientWidth - half, px));
    g.fillStyle = this.#colours.of(colour);
    g.fillRect(px - wide / 2, 0, wide, height - FOOT);
    g.beginPath();
    g.roundRect(middle - half, height - FOOT + 3, 2 * half, FOOT - 6, 4);
    g.fill();
    g.fillStyle = this.#colours.of("background");
    g.textAlign = "center";
    g.fillText(text, middle, height - FOOT / 2 + 0.5);
    g.font = "11px Inter, Arial, sans-serif";
  }

  /** @param {MouseEvent} e */
  #spanAt(e) {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [e.clientX - box.left, e.clientY - box.top];
    const hit = this.hits.findLast((h) => px >= h.left - 1 && px <= h.right + 1 && py >= h.top && py <= h.bottom);
    return hit?.span ?? null;
  }

  /** @param {PointerEvent} e */
  #down(e) {
    const { left, bottom } = this.canvas.getBoundingClientRect();
    const from = e.clientX - left;
    if (e.button !== 0 || from < this.names) return;
    const selects = e.pointerType === "mouse" && e.clientY < bottom - FOOT; // other drags move the instant shown
    const begin = this.#timeAt(from);
    const span = this.#spanAt(e);
    let dragged = false;
    const [, stop] = this.#range();
    this.end ??= stop;
    const seek = (/** @type {PointerEvent} */ m) =>
      store.seek(Math.min(this.#timeAt(m.clientX - left), store.run.last() ?? stop));
    const move = (/** @type {PointerEvent} */ m) => {
      if (Math.abs(m.clientX - left - from) > 3) dragged = true;
      if (dragged && selects) store.selectStretch(begin, this.#timeAt(m.clientX - left));
      else if (dragged || (!span && !selects)) seek(m);
    };
    drag(move, (m) => {
      if (dragged && selects) return;
      seek(m);
      if (!dragged && span) this.onPick(span.path);
    });
  }

  /** @param {WheelEvent} e */
  #wheel(e) {
    e.preventDefault();
    if (e.shiftKey || (!e.ctrlKey && e.deltaX === 0 && e.offsetX < this.names)) this.top += e.deltaY || e.deltaX;
    else this.#zoom(e);
    this.draw();
  }

  /** @param {WheelEvent} e */
  #zoom(e) {
    const [, to] = this.#range();
    if (Math.abs(e.deltaX) > Math.abs(e.deltaY)) {
      this.end = to + (e.deltaX / this.canvas.clientWidth) * this.length;
      return;
    }
    const at = this.#timeAt(e.offsetX);
    const length = Math.max(SHORTEST_MS, Math.min(this.length * Math.exp(e.deltaY * 0.0016), LONGEST_MS));
    if (this.end !== null || store.cursor.value !== null) this.end = at + ((to - at) * length) / this.length;
    this.length = length;
  }

  /** @param {KeyboardEvent} e */
  #key(e) {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 }[e.key];
    if (step !== undefined) {
      store.seekEvent(step);
      e.stopPropagation();
    } else if (e.key === "End") this.live();
    else if (e.key === "Home") store.seek(store.run.first());
    else return;
    e.preventDefault();
  }
}

/** @param {StateNode} lane */
const laneHeight = (lane) =>
  lane.kind === "concurrence" ? Math.max(LANE, ROW * Math.min(lane.children.length, MOST_ROWS) + 3) : LANE;

/**
 * The index of the first span to draw. Spans are in order of their beginnings, and only roughly in that of their ends,
 * so some before the one that is found are drawn as well.
 * @param {Span[]} spans
 * @param {number} t
 */
const firstAfter = (spans, t) => Math.max(0, countWhile(spans, (span) => (span.to ?? Infinity) < t) - 16);

/** @param {Span} span */
function describe(span) {
  const { from, to, preempt, serviced, abandoned } = span;
  const seconds = (/** @type {number} */ some) => `${(some / 1000).toFixed(3)} s`;
  const lines = [span.path, to === null ? "runs" : `${seconds(to - from)}, ${span.outcome ?? "its end is unknown"}`];
  if (preempt !== null) {
    lines.push(`asked to stop after ${seconds(preempt - from)} by ${askerText(span.asked) ?? "?"}`);
    if (serviced !== null) lines.push(`preempt serviced ${seconds(serviced - preempt)} later`);
    if (abandoned !== null) lines.push(`abandoned ${seconds(abandoned - preempt)} later`);
  }
  return lines.join("\n");
}
