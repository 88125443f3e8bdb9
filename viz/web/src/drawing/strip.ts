// The strip above the timeline: the whole run, and the part of it that the timeline shows as a window that can be
// dragged and stretched.

import { asksIn, type Density, densityOf } from "#core/density.ts";
import { Axis } from "#core/idle.ts";
import { store } from "#core/store.ts";
import { Colours, fitted } from "#drawing/theme.ts";
import { SHORTEST_MS } from "#drawing/time_window.ts";
import { drag } from "#drawing/viewport.ts";

const RIGHT = 14;
const GRIP = 8; // width of an end of the window
const COLUMN = 3;
const FAILURE = 2.5;

export type Range = { from: number; to: number };

export class Strip {
  canvas: HTMLCanvasElement;
  left = 168; // where the lanes begin [px]
  shown: Range = { from: 0, to: 1 }; // what the timeline shows [ms]
  #context: CanvasRenderingContext2D;
  #colours = new Colours();
  #onRange: (range: Range | null) => void;
  #density: Density | null = null;
  #key = "";

  /** @param onRange called with the range that the timeline is to show [ms]; null: the whole */
  constructor(canvas: HTMLCanvasElement, onRange: (range: Range | null) => void) {
    this.canvas = canvas;
    this.#context = canvas.getContext("2d") as CanvasRenderingContext2D;
    this.#onRange = onRange;
    canvas.addEventListener("pointerdown", (e) => this.#down(e));
    canvas.addEventListener("dblclick", () => this.#onRange(null));
  }

  restyle() {
    this.#colours.forget();
  }

  /** The time of the whole run [ms]; null before it begins. */
  #whole(): Range | null {
    const from = store.data.run.first();
    if (from === null) return null;
    return { from, to: Math.max(store.data.liveMs(), from + SHORTEST_MS) };
  }

  draw() {
    const g = this.#context;
    const size = fitted(g);
    const whole = this.#whole();
    if (!size || !whole) return;
    const { width, height } = size;
    const wide = width - this.left - RIGHT;
    if (wide < 40) return;
    const axis = new Axis(store.clock.folds(), whole, this.left, this.left + wide);
    const x = (t: number) => axis.x(t);
    const columns = Math.floor(wide / COLUMN);
    const { events } = store.data.run;
    // A density of many events is computed anew only when its picture would change.
    const step = (whole.to - whole.from) / columns;
    const end = Math.floor(whole.to / Math.max(step, 250));
    const folds = axis.folds.map(({ from }) => from);
    const key = [store.data.model.value?.root.path, events[0]?.seq, events.length, columns, end, ...folds].join(" ");
    if (key !== this.#key || !this.#density) {
      this.#density = densityOf(events, (t) => (x(t) - this.left) / COLUMN, columns, store.data.model.value);
      this.#key = key;
    }
    const { counts, failures, preempts, starts } = this.#density;
    g.clearRect(0, 0, width, height);
    const most = Math.max(1, ...counts);
    g.fillStyle = this.#colours.of("faint");
    for (const [i, count] of counts.entries()) {
      const tall = Math.sqrt(count / most) * (height - 6);
      if (count) g.fillRect(this.left + i * COLUMN, height - 3 - tall, COLUMN - 0.5, tall);
    }
    g.fillStyle = this.#colours.of("waiting-fill");
    for (const [from, to] of asksIn(store.data.run.waits, whole.to))
      g.fillRect(x(from), 3, Math.max(2, x(to) - x(from)), height - 6);
    for (const [from, to] of store.data.run.now.outages ?? []) {
      g.fillStyle = this.#colours.of("background");
      g.fillRect(x(from / 1e6), 0, Math.max(2, x(to / 1e6) - x(from / 1e6)), height);
    }
    const ticks = (colour: string, instants: number[], thick: number, top: number) => {
      g.fillStyle = this.#colours.of(colour);
      for (const t of instants) g.fillRect(x(t) - thick / 2, top, thick, height - top);
    };
    g.strokeStyle = this.#colours.of("muted");
    g.lineWidth = 1.2;
    for (const { from, to } of axis.folds) {
      const [begin, last] = [x(from), x(to)];
      g.fillStyle = this.#colours.of("depth2");
      g.fillRect(begin, 0, last - begin, height);
      g.beginPath();
      for (let y = 0, side = -1; y <= height; y += 4, side = -side) g.lineTo((begin + last) / 2 + 2.5 * side, y);
      g.stroke();
    }
    ticks("preempted", preempts, 1.5, height / 2);
    ticks("ink", starts, 1.5, 0);
    ticks("failure", failures, FAILURE, 0);
    this.#window(x, height, width);
    const at = store.playback.cursor.value;
    if (at !== null) ticks("active", [at], 2, 0);
  }

  /** Draw what the timeline shows, with its ends. */
  #window(x: (t: number) => number, height: number, width: number) {
    const g = this.#context;
    const [left, right] = this.#ends(x, width);
    g.fillStyle = this.#colours.of("active");
    g.globalAlpha = 0.12;
    g.fillRect(left, 0, right - left, height);
    g.globalAlpha = 1;
    g.strokeStyle = this.#colours.of("active");
    g.lineWidth = 1.5;
    g.strokeRect(left + 0.75, 0.75, right - left - 1.5, height - 1.5);
    for (const px of [left, right]) {
      g.beginPath();
      g.roundRect(px - GRIP / 2, height / 2 - 9, GRIP, 18, 3);
      g.fillStyle = this.#colours.of("background");
      g.fill();
      g.stroke();
    }
  }

  #ends(x: (t: number) => number, width: number): [number, number] {
    const inside = (px: number) => Math.max(this.left, Math.min(width - RIGHT, px));
    const left = inside(x(this.shown.from));
    return [left, Math.max(inside(x(this.shown.to)), left + 4)];
  }

  /** Drag the window or one of its ends; a press beside it brings it there. */
  #down(e: PointerEvent) {
    const whole = this.#whole();
    const width = this.canvas.clientWidth;
    const { left: edge } = this.canvas.getBoundingClientRect();
    const wide = width - this.left - RIGHT;
    if (!whole || e.button !== 0 || e.clientX - edge < this.left - GRIP) return;
    const axis = new Axis(store.clock.folds(), whole, this.left, this.left + wide);
    const [left, right] = this.#ends((t) => axis.x(t), width);
    const px = e.clientX - edge;
    let { from, to } = this.shown;
    const near = (end: number) => Math.abs(px - end) <= GRIP;
    const isLeft = near(left) && !(near(right) && px > (left + right) / 2);
    const isRight = !isLeft && near(right);
    if (!isLeft && !isRight && (px < left || px > right)) {
      const half = (axis.x(to) - axis.x(from)) / 2;
      [from, to] = [axis.timeAt(px - half), axis.timeAt(px + half)];
      this.#onRange({ from, to });
    }
    drag((m) => {
      const moved = (t: number) => axis.timeAt(axis.x(t) + m.clientX - e.clientX);
      if (isLeft) this.#onRange({ from: Math.min(moved(from), to - SHORTEST_MS), to });
      else if (isRight) this.#onRange({ from, to: Math.max(moved(to), from + SHORTEST_MS) });
      else this.#onRange({ from: moved(from), to: moved(to) });
    });
  }
}
