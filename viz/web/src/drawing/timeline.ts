// The timeline: a lane for each container, with a row for each branch of a concurrence.

import { ms } from "#core/fold.ts";
import { countWhile } from "#core/lists.ts";
import type { Model } from "#core/model.ts";
import { endClass } from "#core/outcomes.ts";
import { purposeOfVisit, wordsOf } from "#core/purposes.ts";
import { pins } from "#core/reproduction.ts";
import { COLOURS } from "#core/scene.ts";
import { store } from "#core/store.ts";
import { askerText, duration } from "#core/text.ts";
import type { Span, StateNode } from "#core/types.ts";
import { Colours, fitted } from "#drawing/theme.ts";
import { drag } from "#drawing/viewport.ts";

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
const FAILED = 3; // narrowest bar of a failure
const MOST_WIDTHS = 4000; // texts whose widths are kept
const LIVE_MS = 30_000; // shown at first
const SHORTEST_MS = 200; // the shortest time that can fill the timeline
const LONGEST_MS = 30 * 86_400_000;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14_400];

/** the range shown [ms], and its pixels */
export type Scale = { from: number; to: number; x: (t: number) => number };
export type Hit = { left: number; right: number; top: number; bottom: number; span: Span };

export class Timeline {
  canvas: HTMLCanvasElement;
  context: CanvasRenderingContext2D;
  onPick: (path: string) => void;
  onDraw: (range: { from: number; to: number }) => void;
  length = LIVE_MS; // shown [ms]
  end: number | null = null; // of the range shown [ms]; null: now
  top = 0; // vertical scroll [px]
  names = NAMES;
  scale: Scale | null = null; // of the last drawing
  tallest = 0; // height of all lanes and the axis [px]
  lanes: StateNode[] = []; // in the order of the tree
  spansOf: Map<string, Span[]> = new Map(); // by path of the lane
  model: Model | null = null;
  spans: Span[] | null = null;
  sorted = 0; // number of spans that are in lanes
  hits: Hit[] = [];
  gaps: [number, number][] = []; // outages [px]
  #widths: Map<string, number> = new Map(); // of texts in bars [px]
  #colours = new Colours();

  constructor(
    canvas: HTMLCanvasElement,
    { onPick, onDraw }: { onPick: (path: string) => void; onDraw: (range: { from: number; to: number }) => void },
  ) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d") as CanvasRenderingContext2D;
    this.onPick = onPick;
    this.onDraw = onDraw;
    canvas.addEventListener("pointerdown", (e) => this.#down(e));
    canvas.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    canvas.addEventListener("pointermove", (e) => {
      const span = this.#spanAt(e);
      canvas.title = span ? describe(span) : "";
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
      if (span) this.#show(span.from, span.to ?? store.playback.nowMs());
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
    const first = store.data.run.first();
    const last = store.playback.nowMs();
    if (first == null) return;
    this.length = Math.max(500, (last - first) * 1.04);
    this.end = last + this.length * 0.02;
  }

  /** Show a visit with some time around it. @param to [ms] */
  #show(from: number, to: number) {
    const length = Math.max(SHORTEST_MS, (to - from) * 1.1);
    this.end = (from + to) / 2 + length / 2;
    this.length = length;
    this.draw();
  }

  /** Show a range [ms]; one that reaches the present of a running machine moves on with it. */
  showRange({ from, to }: { from: number; to: number }) {
    const isLive = store.playback.cursor.value === null && store.playback.goes.value && to >= store.data.liveMs();
    this.length = Math.max(SHORTEST_MS, to - from);
    this.end = isLive ? null : to;
    this.draw();
  }

  /** Follow the present. */
  live() {
    this.end = null;
    store.playback.seek(null);
  }

  /** The range shown [ms]. */
  #range(): [number, number] {
    const now = store.playback.nowMs();
    let end = this.end ?? now + this.length * 0.01;
    if (this.end === null && store.playback.cursor.value !== null) end = now + this.length / 2;
    const first = store.data.run.first(); // a run shorter than the range begins at the left
    if (this.end === null && store.playback.cursor.value === null && first != null)
      end = Math.max(end, first + this.length * 0.98);
    return [end - this.length, end];
  }

  /** Keep the played instant in view. */
  #keepInView() {
    const at = store.playback.cursor.value;
    if (this.end === null || at === null || !store.playback.playing.value) return;
    if (at > this.end - 0.02 * this.length) this.end = at + 0.8 * this.length;
    else if (at < this.end - this.length) this.end = at + 0.95 * this.length;
  }

  #timeAt(px: number) {
    const [from, to] = this.#range();
    return from + ((px - this.names) / (this.canvas.clientWidth - this.names - RIGHT)) * (to - from);
  }

  /** Put new spans into lanes; a container gets a lane when a state in it has run. */
  #makeLanes(model: Model, spans: Span[]) {
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

  /** Tell screen readers the instant shown, as the value of a slider [s]. */
  tellInstant() {
    const began = store.playback.began() ?? 0;
    const seconds = (t: number) => String(Math.max(0, Math.round((t - began) / 1000)));
    this.canvas.setAttribute("aria-valuemin", "0");
    this.canvas.setAttribute("aria-valuemax", seconds(store.data.liveMs()));
    this.canvas.setAttribute("aria-valuenow", seconds(store.playback.nowMs()));
    this.canvas.setAttribute("aria-valuetext", store.clock.instantText(store.playback.nowMs()));
  }

  draw() {
    const g = this.context;
    const model = store.data.model.value;
    const size = fitted(g);
    if (!size || !model) return;
    const { width, height } = size;
    this.names = width < 640 ? NAMES_NARROW : NAMES;
    g.clearRect(0, 0, width, height);
    g.font = "11px Inter, Arial, sans-serif";
    g.textBaseline = "middle";
    this.#makeLanes(model, store.data.run.spans);
    this.#keepInView();
    const [from, to] = this.#range();
    const x = (t: number) => this.names + ((t - from) / (to - from)) * (width - this.names - RIGHT);
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

  /** Draw the selected stretch. */
  #stretch(x: (t: number) => number, height: number) {
    const found = store.playback.stretch.value;
    if (!found) return;
    const g = this.context;
    const [left, right] = [found.from, found.to].map((t) => Math.max(this.names, x(t)));
    g.fillStyle = this.#colours.of("ink");
    g.globalAlpha = 0.1;
    g.fillRect(left, 0, right - left, height - FOOT);
    g.globalAlpha = 1;
    for (const px of [left, right]) g.fillRect(px - 0.75, 0, 1.5, height - FOOT);
    g.fillRect(left, height - FOOT, right - left, store.playback.looping.value ? 4 : 2);
  }

  /** Draw the outages. */
  #outages({ from, to, x }: Scale, width: number, height: number) {
    const g = this.context;
    this.gaps = [];
    for (const [begin, end] of store.data.run.now.outages ?? []) {
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

  /** Draw a pin at each note, with its text. */
  #notes(x: (t: number) => number, width: number, height: number) {
    const g = this.context;
    for (const { at, text } of pins()) {
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

  #clipped(x: number, y: number, w: number, h: number, paint: () => void) {
    const g = this.context;
    g.save();
    g.beginPath();
    g.rect(x, y, w, h);
    g.clip();
    paint();
    g.restore();
  }

  /** The lanes of the names that are looked for; all if there is room, otherwise those with spans in the range. */
  #lanesToShow({ from, to }: Scale, room: number) {
    const wanted = store.view.laneFilter.value
      .toLowerCase()
      .split(/[\s,]+/)
      .filter(Boolean);
    const named = (lane: StateNode) => [lane, ...lane.children].some(({ path }) => isNamed(path, wanted));
    const lanes = wanted.length ? this.lanes.filter(named) : this.lanes;
    const tall = lanes.reduce((sum, lane) => sum + laneHeight(lane), 0);
    if (tall <= room) return lanes;
    return lanes.filter((lane) => {
      const spans = this.spansOf.get(lane.path) ?? [];
      for (let i = firstAfter(spans, from); i < spans.length && spans[i].from <= to; i++)
        if ((spans[i].to ?? Infinity) >= from) return true;
      return false;
    });
  }

  #grid({ from, to, x }: Scale, width: number, height: number) {
    const g = this.context;
    const begun = ms(store.playback.shown().started) ?? store.data.run.first() ?? from;
    const widthOf = (s: number) => ((s * 1000) / (to - from)) * (width - this.names);
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
      const text = store.clock.instantText(t, step < 1000 ? 1 : 0);
      if (px + 3 + g.measureText(text).width < width) g.fillText(text, px + 3, height - FOOT / 2);
    }
  }

  #lane(lane: StateNode, y: number, h: number, { from, to, x }: Scale, width: number) {
    const g = this.context;
    g.fillStyle = this.#colours.of("muted");
    g.textAlign = "left";
    const indent = 10 + Math.min(lane.depth, 6) * 9;
    this.#clipped(0, y, this.names - 8, h, () => g.fillText(lane.name, indent, y + h / 2));
    const rows = lane.kind === "concurrence" ? lane.children.length : 1;
    const spans = this.spansOf.get(lane.path) ?? [];
    const now = store.playback.nowMs();
    let lastPx = -10;
    const failures: (() => void)[] = []; // drawn last, over all others
    for (let i = firstAfter(spans, from); i < spans.length; i++) {
      const span = spans[i];
      if (span.from > to) break;
      const later = span.from > now; // after the instant shown
      const ended = span.to !== null && (later || span.to <= now);
      const until = span.to ?? Math.max(now, store.data.run.last() ?? now);
      const node = this.model?.get(span.path);
      if (until < from || !node) continue;
      const left = Math.max(this.names, x(span.from));
      const right = Math.min(width - RIGHT + 2, x(until));
      const isFailure = ended && endClass(node, span.outcome) === "failure";
      if (rows === 1 && right - lastPx < THINNEST && ended && !isFailure) continue; // too thin to see
      lastPx = Math.max(lastPx, right);
      const row = rows > 1 ? lane.children.indexOf(node) : 0;
      const pitch = (h - 3) / rows;
      const top = y + 1.5 + row * pitch;
      // Of very many branches each bar is a line, and the lines overlap.
      const tall = Math.max(1, pitch - (rows > 1 ? Math.min(1.5, pitch / 4) : 0));
      const wide = Math.max(isFailure ? FAILED : 2, right - left);
      const hit = { left, right: left + wide, top, bottom: top + tall, span };
      const paint = () => {
        g.globalAlpha = later ? 0.35 : 1;
        this.#bar(hit, node, ended, x, later ? Infinity : now);
        g.globalAlpha = 1;
        this.hits.push(hit);
      };
      if (isFailure) failures.push(paint);
      else paint();
    }
    for (const paint of failures) paint();
    this.#waits(lane, y, h, rows, { from, to, x }, width);
  }

  /** Draw the times in which the lane's states were paused before they began, or asked. */
  #waits(lane: StateNode, y: number, h: number, rows: number, { from, to, x }: Scale, width: number) {
    const g = this.context;
    const now = store.playback.nowMs();
    for (const wait of store.data.run.waits) {
      const until = Math.min(wait.to ?? now, now);
      if (until < from || wait.from > Math.min(to, now)) continue;
      const node = this.model?.get(wait.path);
      if (!node || node.parent?.path !== lane.path) continue;
      const [left, right] = [Math.max(this.names, x(wait.from)), Math.min(width - RIGHT + 2, x(until))];
      const row = rows > 1 ? lane.children.indexOf(node) : 0;
      const pitch = (h - 3) / rows;
      const [top, tall] = [y + 1.5 + row * pitch, Math.max(1, pitch - (rows > 1 ? Math.min(1.5, pitch / 4) : 0))];
      const wide = Math.max(2, right - left);
      const asks = wait.kind === "asks";
      const colour = asks ? "waiting" : "other";
      g.save();
      g.beginPath();
      g.roundRect(left, top, wide, tall, Math.min(4, tall / 2, wide / 2));
      g.fillStyle = this.#colours.of(`${colour}-fill`);
      g.fill();
      g.clip();
      g.strokeStyle = this.#colours.of(colour);
      if (!asks) {
        g.globalAlpha = 0.35;
        g.lineWidth = 2;
        for (let px = left - tall; px < right; px += 7) {
          g.beginPath();
          g.moveTo(px, top + tall);
          g.lineTo(px + tall, top);
          g.stroke();
        }
      }
      g.restore();
      g.strokeStyle = this.#colours.of(colour);
      g.setLineDash(asks ? [1.5, 2.5] : []);
      g.lineWidth = 1.4;
      g.stroke();
      g.setLineDash([]);
      const took = duration(Math.max(0, until - wait.from) / 1000);
      const words = asks ? `${node.name} ?` : wait.text;
      this.#text([`${words} ${took}`, words, asks ? "?" : ""], `${colour}-text`, left, top, wide, tall);
    }
  }

  /**
   * Write the longest of several texts that fits into a bar; of a running state its beginning.
   * @param texts the longest first
   */
  #text(texts: string[], colour: string, left: number, top: number, wide: number, tall: number) {
    if (wide <= 14 || tall <= 9) return;
    const g = this.context;
    const size = tall > 13 ? 11 : 9.5;
    g.font = `${size}px Inter, Arial, sans-serif`;
    const text = texts.find((one) => this.#widthOf(one, size) <= wide - 8) ?? "";
    const shown = text || (wide > 26 ? (texts.at(-1) ?? "") : "");
    g.fillStyle = this.#colours.of(colour);
    g.textAlign = "left";
    if (shown) this.#clipped(left, top, wide - 3, tall, () => g.fillText(shown, left + 4, top + tall / 2 + 0.5));
    g.font = "11px Inter, Arial, sans-serif";
  }

  /** @param size of the font, which is set [px] */
  #widthOf(text: string, size: number) {
    const key = `${size} ${text}`;
    let width = this.#widths.get(key);
    if (width === undefined) {
      width = this.context.measureText(text).width;
      if (this.#widths.size > MOST_WIDTHS) this.#widths.clear();
      this.#widths.set(key, width);
    }
    return width;
  }

  /** @param now the instant shown [ms]; later parts are pale */
  #bar(
    { left, right, top, bottom, span }: Hit,
    node: StateNode,
    ended: boolean,
    x: (t: number) => number,
    now: number,
  ) {
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
    if (store.view.selected.value === span.path) {
      g.strokeStyle = this.#colours.of("ink"); // as in the diagram, and different from a running state
      g.lineWidth = 2;
      g.strokeRect(left - 1, top - 1, wide + 2, tall + 2);
    }
    const driver = store.data.scene.colourOf(span.path);
    if (driver >= 0) {
      g.fillStyle = this.#colours.of(`s${1 + (driver % COLOURS)}`); // of its track on the map
      g.fillRect(left + 2, bottom - 4, Math.max(0, wide - 4), 2.5);
    }
    const lit = store.pointer.hovered.value;
    if (lit?.path === span.path && lit.from === span.from) this.#halo({ left, right, top, bottom });
    this.#mark(span.serviced, "preempted", x, now, { right, top, tall });
    this.#mark(span.abandoned, "failure", x, now, { right, top, tall });
    const words = wordsOf(node.name, span, now === Infinity ? (span.to ?? store.playback.nowMs()) : now);
    this.#text(words, `${kind}-text`, left, top, wide, tall);
  }

  /** Draw a ring around the visit that the pointer is on here or in the map. */
  #halo({ left, right, top, bottom }: Omit<Hit, "span">) {
    const g = this.context;
    for (const [name, wide] of [
      ["ink", 4.5],
      ["halo", 2.5],
    ] as [string, number][]) {
      g.strokeStyle = this.#colours.of(name);
      g.lineWidth = wide;
      g.beginPath();
      g.roundRect(left - 1, top - 1, right - left + 2, bottom - top + 2, 4);
      g.stroke();
    }
  }

  /** Mark the instant at which a preempt was serviced or the state was abandoned. */
  #mark(
    t: number | null,
    colour: string,
    x: (t: number) => number,
    now: number,
    { right, top, tall }: { right: number; top: number; tall: number },
  ) {
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

  #hover(px: number | null) {
    store.pointer.pointed.value = px !== null && px >= this.names ? this.#timeAt(px) : null;
  }

  /** Draw the instants at the pointer and shown. */
  #cursor(x: (t: number) => number, height: number) {
    const at = store.playback.cursor.value;
    const pointed = store.pointer.pointed.value;
    if (pointed !== null && x(pointed) >= this.names) this.#flag(x(pointed), pointed, height, "muted", 1);
    if (at === null) return;
    const last = this.canvas.clientWidth - RIGHT;
    const px = Math.max(this.names, Math.min(last, x(at))); // outside the range it is drawn at the edge
    this.#flag(px, at, height, "active", 2);
  }

  /** Draw a line through the lanes, with its instant at the axis. */
  #flag(px: number, t: number, height: number, colour: string, wide: number) {
    const g = this.context;
    const text = store.clock.instantText(t);
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

  #spanAt(e: MouseEvent) {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [e.clientX - box.left, e.clientY - box.top];
    const hit = this.hits.findLast((h) => px >= h.left - 1 && px <= h.right + 1 && py >= h.top && py <= h.bottom);
    return hit?.span ?? null;
  }

  #down(e: PointerEvent) {
    const { left, bottom } = this.canvas.getBoundingClientRect();
    const from = e.clientX - left;
    if (e.button !== 0 || from < this.names) return;
    const selects = e.pointerType === "mouse" && e.clientY < bottom - FOOT; // other drags move the instant shown
    const begin = this.#timeAt(from);
    const span = this.#spanAt(e);
    let dragged = false;
    const [, stop] = this.#range();
    this.end ??= stop;
    const seek = (m: PointerEvent) =>
      store.playback.seek(Math.min(this.#timeAt(m.clientX - left), store.data.run.last() ?? stop));
    const move = (m: PointerEvent) => {
      if (Math.abs(m.clientX - left - from) > 3) dragged = true;
      if (dragged && selects) store.playback.selectStretch(begin, this.#timeAt(m.clientX - left));
      else if (dragged || (!span && !selects)) seek(m);
    };
    drag(move, (m) => {
      if (dragged && selects) return;
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
    const [, to] = this.#range();
    if (Math.abs(e.deltaX) > Math.abs(e.deltaY)) {
      this.end = to + (e.deltaX / this.canvas.clientWidth) * this.length;
      return;
    }
    const at = this.#timeAt(e.offsetX);
    const length = Math.max(SHORTEST_MS, Math.min(this.length * Math.exp(e.deltaY * 0.0016), LONGEST_MS));
    if (this.end !== null || store.playback.cursor.value !== null) this.end = at + ((to - at) * length) / this.length;
    this.length = length;
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

/** Whether the name of a state contains one of some words. */
const isNamed = (path: string, words: string[]) => {
  const name = path.slice(path.lastIndexOf("/") + 1).toLowerCase();
  return words.some((word) => name.includes(word));
};

const laneHeight = (lane: StateNode) =>
  lane.kind === "concurrence" ? Math.max(LANE, ROW * Math.min(lane.children.length, MOST_ROWS) + 3) : LANE;

/**
 * The index of the first span to draw. Spans are in order of their beginnings, and only roughly in that of their ends,
 * so some before the one that is found are drawn as well.
 */
const firstAfter = (spans: Span[], t: number) =>
  Math.max(0, countWhile(spans, (span) => (span.to ?? Infinity) < t) - 16);

function describe(span: Span) {
  const { from, to, preempt, serviced, abandoned } = span;
  const purpose = purposeOfVisit(span);
  const seconds = (some: number) => `${(some / 1000).toFixed(3)} s`;
  const lines = [
    purpose ? `${span.path} \u2192 ${purpose}` : span.path,
    to === null ? "runs" : `${seconds(to - from)}, ${span.outcome ?? "its end is unknown"}`,
  ];
  if (span.attempt) lines.push(`attempt ${span.attempt}`);
  if (preempt !== null) {
    lines.push(`asked to stop after ${seconds(preempt - from)} by ${askerText(span.asked) ?? "?"}`);
    if (serviced !== null) lines.push(`preempt serviced ${seconds(serviced - preempt)} later`);
    if (abandoned !== null) lines.push(`abandoned ${seconds(abandoned - preempt)} later`);
  }
  return lines.join("\n");
}
