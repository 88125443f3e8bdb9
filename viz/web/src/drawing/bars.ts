// Draws a lane of the timeline: a bar for each visit of a state, and for each time in which one waited.

import type { Axis } from "#core/idle.ts";
import type { Model } from "#core/model.ts";
import { endClass } from "#core/outcomes.ts";
import { wordsOf } from "#core/purposes.ts";
import { COLOURS } from "#core/scene.ts";
import { store } from "#core/store.ts";
import { duration } from "#core/text.ts";
import type { Span, StateNode } from "#core/types.ts";
import type { Lanes } from "#drawing/lanes.ts";
import { type Colours, FONT } from "#drawing/theme.ts";

// Sizes in CSS pixels
const THINNEST = 0.5;
const FAILED = 3; // narrowest bar of a failure
const LATER = 0.35; // opacity of what is after the instant shown
const NAME = 11; // of a lane
const TRACK = 2; // height of the line in the colour of a track
const LEAST_LETTERS = 2; // of a name that is cut
const MOST_WIDTHS = 4000; // texts whose widths are kept

/** [px] */
type Bar = { left: number; right: number; top: number; bottom: number };
export type Hit = Bar & { span: Span };

export class Bars {
  context: CanvasRenderingContext2D;
  colours: Colours;
  hits: Hit[] = []; // the bars of visits that were drawn since they were forgotten
  #widths: Map<string, number> = new Map(); // of texts in bars [px]

  constructor(context: CanvasRenderingContext2D, colours: Colours) {
    this.context = context;
    this.colours = colours;
  }

  forget() {
    this.hits = [];
  }

  /** Draw a lane's name, bars and waits. */
  lane(lane: StateNode, y: number, lanes: Lanes, model: Model, scale: Axis) {
    const g = this.context;
    const h = lanes.heightOf(lane);
    g.fillStyle = this.colours.of("muted");
    g.textAlign = "left";
    const indent = 10 + Math.min(lane.depth, 6) * 9;
    const room = scale.left - 8 - indent;
    const widthOf = (one: string) => this.#widthOf(one, NAME);
    const name = widthOf(lane.name) > room ? beginningOf(lane.name, room, widthOf) : lane.name;
    g.fillText(name, indent, y + h / 2);
    this.#visits(lane, y, lanes, model, scale);
    this.#waits(lane, y, lanes, model, scale);
  }

  #visits(lane: StateNode, y: number, lanes: Lanes, model: Model, axis: Axis) {
    const { from, to, left, right } = axis;
    const x = (t: number) => axis.x(t);
    const g = this.context;
    const now = store.playback.nowMs();
    const isOneRow = lanes.rowsOf(lane) === 1;
    let lastPx = -10;
    const failures: (() => void)[] = []; // drawn last, over all others
    for (const span of lanes.spansIn(lane, from, to)) {
      const later = span.from > now; // after the instant shown
      const ended = span.to !== null && (later || span.to <= now);
      const until = span.to ?? Math.max(now, store.data.run.last() ?? now);
      const node = model.get(span.path);
      if (until < from || !node) continue;
      const begin = Math.max(left, x(span.from));
      const end = Math.min(right + 2, x(until));
      const isFailure = ended && endClass(node, span.outcome) === "failure";
      if (isOneRow && end - lastPx < THINNEST && ended && !isFailure) continue; // too thin to see
      lastPx = Math.max(lastPx, end);
      const wide = Math.max(isFailure ? FAILED : 2, end - begin);
      const hit = { left: begin, right: begin + wide, ...rowOf(lanes, lane, node, span.from, y), span };
      const paint = () => {
        g.globalAlpha = later ? LATER : 1;
        this.#visit(hit, node, ended, x, later ? Infinity : now);
        g.globalAlpha = 1;
        this.hits.push(hit);
      };
      if (isFailure) failures.push(paint);
      else paint();
    }
    for (const paint of failures) paint();
  }

  /** @param now the instant shown [ms]; later parts are pale */
  #visit({ span, ...bar }: Hit, node: StateNode, ended: boolean, x: (t: number) => number, now: number) {
    const g = this.context;
    const { left, right, top, bottom } = bar;
    const [wide, tall] = [right - left, bottom - top];
    const asked = span.preempt !== null && span.preempt <= now ? span.preempt : null;
    const kind = ended ? endClass(node, span.outcome) : asked !== null ? "preempted" : "active";
    const shown = x(now);
    const paint = () => this.#body({ span, ...bar }, kind, asked === null ? null : x(asked));
    if (!ended && shown < right - 1) {
      g.globalAlpha = LATER;
      clipped(g, shown, top - 1, right + 1 - shown, tall + 2, paint);
      g.globalAlpha = 1;
      clipped(g, left - 1, top - 1, shown - left + 1, tall + 2, paint);
    } else paint();
    if (store.view.selected.value === span.path) {
      g.strokeStyle = this.colours.of("ink"); // as in the diagram, and different from a running state
      g.lineWidth = 2;
      g.strokeRect(left - 1, top - 1, wide + 2, tall + 2);
    }
    const lit = store.pointer.hovered.value;
    if (lit?.path === span.path && lit.from === span.from) this.#halo(bar);
    if (span.serviced !== null && span.serviced <= now) this.#mark(Math.min(x(span.serviced), right), bar, "preempted");
    if (span.abandoned !== null && span.abandoned <= now)
      this.#mark(Math.min(x(span.abandoned), right), bar, "failure");
    const words = wordsOf(node.name, span, now === Infinity ? (span.to ?? store.playback.nowMs()) : now);
    const above = store.data.scene.colourOf(span.path) < 0 ? bottom : bottom - TRACK;
    this.#text(words, `${kind}-text`, { ...bar, bottom: above });
  }

  /** @param asked where the hatch of a request to stop begins [px] */
  #body({ span, ...bar }: Hit, kind: string, asked: number | null) {
    const g = this.context;
    const { left, right, top, bottom } = bar;
    g.fillStyle = this.colours.of(`${kind}-fill`);
    g.strokeStyle = this.colours.of(kind);
    g.lineWidth = 1.1;
    this.#outline(bar);
    g.fill();
    if (asked !== null) {
      // hatch the time from the request to the end
      g.save();
      g.clip();
      g.fillStyle = this.colours.of("preempted");
      g.globalAlpha *= 0.55;
      for (let px = Math.max(left, asked); px < right; px += 5) g.fillRect(px, top, 2.5, bottom - top);
      g.restore();
    }
    g.stroke();
    const driver = store.data.scene.colourOf(span.path);
    if (driver < 0) return;
    g.fillStyle = this.colours.of(`s${1 + (driver % COLOURS)}`); // of its track on the map
    g.fillRect(left + 2, bottom - TRACK - 0.5, Math.max(0, right - left - 4), TRACK);
  }

  /** Draw the times in which the lane's states were paused before they began, or asked. */
  #waits(lane: StateNode, y: number, lanes: Lanes, model: Model, axis: Axis) {
    const { from, to, left, right } = axis;
    const x = (t: number) => axis.x(t);
    const now = store.playback.nowMs();
    for (const wait of store.data.run.waits) {
      const until = Math.min(wait.to ?? now, now);
      if (until < from || wait.from > Math.min(to, now)) continue;
      const node = model.get(wait.path);
      if (!node || node.parent?.path !== lane.path) continue;
      const begin = Math.max(left, x(wait.from));
      const end = Math.max(Math.min(right + 2, x(until)), begin + 2);
      const bar = { left: begin, right: end, ...rowOf(lanes, lane, node, wait.from, y) };
      const asks = wait.kind === "asks";
      this.#wait(bar, asks);
      const words = asks ? `${node.name} ?` : wait.text;
      const took = duration(Math.max(0, until - wait.from) / 1000);
      this.#text([`${words} ${took}`, words, asks ? "?" : ""], asks ? "waiting-text" : "other-text", bar);
    }
  }

  /** Draw a wait: dotted for a question, hatched for a pause. */
  #wait(bar: Bar, asks: boolean) {
    const g = this.context;
    const colour = asks ? "waiting" : "other";
    const tall = bar.bottom - bar.top;
    g.save();
    this.#outline(bar);
    g.fillStyle = this.colours.of(`${colour}-fill`);
    g.fill();
    g.clip();
    g.strokeStyle = this.colours.of(colour);
    if (!asks) {
      g.globalAlpha = 0.35;
      g.lineWidth = 2;
      for (let px = bar.left - tall; px < bar.right; px += 7) {
        g.beginPath();
        g.moveTo(px, bar.bottom);
        g.lineTo(px + tall, bar.top);
        g.stroke();
      }
    }
    g.restore();
    this.#outline(bar);
    g.strokeStyle = this.colours.of(colour);
    g.setLineDash(asks ? [1.5, 2.5] : []);
    g.lineWidth = 1.4;
    g.stroke();
    g.setLineDash([]);
  }

  #outline({ left, right, top, bottom }: Bar) {
    const [wide, tall] = [right - left, bottom - top];
    this.context.beginPath();
    this.context.roundRect(left, top, wide, tall, Math.min(4, tall / 2, wide / 2));
  }

  /** Draw a ring around the visit that the pointer is on here or in the map. */
  #halo({ left, right, top, bottom }: Bar) {
    const g = this.context;
    for (const [name, wide] of [
      ["ink", 4.5],
      ["halo", 2.5],
    ] as [string, number][]) {
      g.strokeStyle = this.colours.of(name);
      g.lineWidth = wide;
      g.beginPath();
      g.roundRect(left - 1, top - 1, right - left + 2, bottom - top + 2, 4);
      g.stroke();
    }
  }

  /** Mark the place at which a preempt was serviced or the state was abandoned. */
  #mark(px: number, { top, bottom }: Bar, colour: string) {
    const g = this.context;
    g.fillStyle = this.colours.of(colour);
    g.beginPath();
    g.moveTo(px - 3.5, top - 1);
    g.lineTo(px + 3.5, top - 1);
    g.lineTo(px, top + 5);
    g.fill();
    g.fillRect(px - 0.75, top, 1.5, bottom - top);
  }

  /**
   * Write the longest of several texts that fits into a bar, or the beginning of the shortest.
   * @param texts the longest first
   */
  #text(texts: string[], colour: string, { left, right, top, bottom }: Bar) {
    const [wide, tall] = [right - left, bottom - top];
    if (wide <= 14 || tall <= 9) return;
    const g = this.context;
    const size = tall > 13 ? 11 : 9.5;
    g.font = `${size}px Inter, Arial, sans-serif`;
    const widthOf = (one: string) => this.#widthOf(one, size);
    const whole = texts.find((one) => widthOf(one) <= wide - 8);
    const shown = whole ?? beginningOf(texts.at(-1) ?? "", wide - 8, widthOf);
    g.fillStyle = this.colours.of(colour);
    g.textAlign = "left";
    if (shown) clipped(g, left, top, wide - 3, tall, () => g.fillText(shown, left + 4, top + tall / 2 + 0.5));
    g.font = FONT;
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
}

/** As much of a text as fits into a width, with a sign that it goes on; "" if that would be a letter. */
export function beginningOf(text: string, width: number, widthOf: (one: string) => number) {
  // Few are measured: in most texts the letters are about equally wide.
  let length = Math.min(text.length - 1, Math.ceil((text.length * width) / widthOf(text)) + 1);
  for (; length >= LEAST_LETTERS; length--) {
    const short = `${text.slice(0, length).replace(/[\s.,(]+$/, "")}\u2026`;
    if (widthOf(short) <= width) return short;
  }
  return "";
}

/** The top and bottom of a state's row in its lane, which begins at y, at an instant t [ms]. */
function rowOf(lanes: Lanes, lane: StateNode, node: StateNode, t: number, y: number) {
  const rows = lanes.rowsOf(lane);
  const pitch = (lanes.heightOf(lane) - 3) / rows;
  const top = y + 1.5 + (rows > 1 ? lanes.rowAt(lane, node, t) : 0) * pitch;
  // Of very many branches each bar is a line, and the lines overlap.
  return { top, bottom: top + Math.max(1, pitch - (rows > 1 ? Math.min(1.5, pitch / 4) : 0)) };
}

export function clipped(g: CanvasRenderingContext2D, x: number, y: number, w: number, h: number, paint: () => void) {
  g.save();
  g.beginPath();
  g.rect(x, y, w, h);
  g.clip();
  paint();
  g.restore();
}
