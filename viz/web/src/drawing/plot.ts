// A plot beside the timeline, on its axis of instants: uPlot draws the lines and their scale.
import uPlot from "uplot";
import { Axis } from "#core/idle.ts";
import { aligned, Samples } from "#core/series.ts";
import { store } from "#core/store.ts";
import { Colours, FONT } from "#drawing/theme.ts";
import { drag } from "#drawing/viewport.ts";

const SCALE = 44; // width of the scale's numbers [px]
export const RIGHT = 14; // margin, as in the timeline [px]

/** the range shown [ms] */
export type Range = { from: number; to: number };

export class Plot {
  element: HTMLElement;
  samples: Samples[];
  chart: uPlot;
  range: Range = { from: 0, to: 1 };
  #axis = new Axis([], { from: 0, to: 1 }, 0, 1); // of its drawing, from its left
  #colours = new Colours();

  /** @param ids of series */
  constructor(element: HTMLElement, ids: string[], unit: string) {
    this.element = element;
    this.samples = ids.map((id) => new Samples(id));
    const colour = (name: string) => () => this.#colours.of(name);
    const paths = { linear: uPlot.paths.linear?.(), stepped: uPlot.paths.stepped?.({ align: 1 }) };
    const lines = this.samples.map(({ isStep }, i) => ({
      stroke: colour(`s${i + 1}`),
      width: 1.75,
      paths: isStep ? paths.stepped : paths.linear,
      points: { size: 4 },
      gaps: breaksOf,
    }));
    const percent = unit === "%";
    this.chart = new uPlot(
      {
        width: Math.max(1, element.clientWidth),
        height: Math.max(1, element.clientHeight),
        padding: [6, RIGHT, 6, 0],
        cursor: { show: false },
        legend: { show: false },
        scales: {
          x: { time: false, auto: false, distr: 100, fwd: (t) => this.#axis.x(t), bwd: (px) => this.#axis.timeAt(px) },
          y: percent ? { range: [0, 100] } : {},
        },
        axes: [
          { show: false },
          {
            size: SCALE,
            gap: 4,
            font: FONT,
            space: 24,
            stroke: colour("muted"),
            grid: { stroke: colour("hair"), width: 1 },
            ticks: { show: false },
          },
        ],
        series: [{}, ...lines],
        hooks: { draw: [() => this.#marks()] },
      },
      aligned([], 0, 1, 0),
      element,
    );
    element.addEventListener("pointerdown", (e) => this.#down(e));
    element.addEventListener("pointermove", (e) => {
      store.pointer.pointed.value = this.#timeAt(e);
    });
    element.addEventListener("pointerleave", () => {
      store.pointer.pointed.value = null;
    });
  }

  destroy() {
    this.chart.destroy();
  }

  restyle() {
    this.#colours.forget();
  }

  draw(range: Range) {
    const { chart, element } = this;
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!width || !height) return;
    this.range = range;
    this.#axis = new Axis(store.clock.folds(), range, 0, Math.max(1, width - SCALE - RIGHT));
    for (const one of this.samples) one.update(store.data.run, store.data.scene.series);
    if (chart.width !== width || chart.height !== height) chart.setSize({ width, height });
    chart.batch(() => {
      chart.setData(aligned(this.samples, range.from, range.to, store.playback.nowMs()), false);
      chart.setScale("x", { min: range.from, max: range.to });
    });
  }

  /** Mark the instants shown and at the pointer and the hovered visit; the time after the instant shown is pale. */
  #marks() {
    const { ctx: g, bbox } = this.chart;
    const at = (t: number) => bbox.left + (this.#axis.x(t) / this.#axis.right) * bbox.width;
    const within = (px: number) => Math.max(bbox.left, Math.min(px, bbox.left + bbox.width));
    const band = (from: number, to: number, name: string, part = 1) => {
      g.globalAlpha = part;
      g.fillStyle = this.#colours.of(name);
      g.fillRect(within(from), bbox.top, Math.max(0, within(to) - within(from)), bbox.height);
    };
    const ratio = devicePixelRatio || 1;
    g.save();
    for (const fold of this.#axis.folds) band(at(fold.from), at(fold.to), "depth2");
    const span = store.pointer.hoveredSpan();
    if (span) band(at(span.from), at(span.to ?? store.playback.nowMs()), "halo", 0.22);
    const stretch = store.playback.stretch.value;
    if (stretch) band(at(stretch.from), at(stretch.to), "ink", 0.1);
    if (store.playback.cursor.value !== null) {
      band(at(store.playback.cursor.value), bbox.left + bbox.width, "background", 0.55);
      band(at(store.playback.cursor.value) - ratio, at(store.playback.cursor.value) + ratio, "active");
    }
    if (store.pointer.pointed.value !== null)
      band(at(store.pointer.pointed.value), at(store.pointer.pointed.value) + ratio, "muted");
    g.restore();
  }

  #timeAt(e: PointerEvent) {
    const { left, width } = this.chart.over.getBoundingClientRect();
    return this.#axis.timeAt(Math.max(0, Math.min(1, (e.clientX - left) / width)) * this.#axis.right);
  }

  #down(e: PointerEvent) {
    if (e.button !== 0) return;
    const seek = (m: PointerEvent) => store.playback.seek(this.#timeAt(m));
    seek(e);
    drag(seek);
  }
}

/**
 * The breaks of a line, at least one pixel wide: uPlot draws over narrower ones.
 * @param number of the series
 * @param last index shown
 */
function breaksOf(chart: uPlot, number: number, first: number, last: number): [number, number][] {
  const instants = chart.data[0];
  const values = chart.data[number];
  const ratio = devicePixelRatio || 1;
  const breaks: [number, number][] = [];
  let before = -1; // index of the last value
  let isBroken = false;
  for (let i = first; i <= last; i++) {
    if (values[i] === null) isBroken = true;
    if (typeof values[i] !== "number") continue;
    if (isBroken && before >= 0) {
      const [from, to] = [before, i].map((at) => chart.valToPos(instants[at], "x", true));
      breaks.push([from, Math.max(to, from + ratio)]);
    }
    isBroken = false;
    before = i;
  }
  return breaks;
}
