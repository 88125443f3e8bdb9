// What the pointer is on: a visit of a state, highlighted wherever it is drawn, or an instant of the timeline.

import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import type { Data } from "#core/store/data.ts";
import type { Playback } from "#core/store/playback.ts";
import type { Visit } from "#core/types.ts";

export class Pointer {
  readonly hovered: Signal<Visit | null> = signal(null);
  /** The instant below the pointer in the timeline or a plot [ms]. */
  readonly pointed: Signal<number | null> = signal(null);
  #data: Data;
  #playback: Playback;

  constructor(data: Data, playback: Playback) {
    this.#data = data;
    this.#playback = playback;
  }

  /** Set the visit that the pointer is on, in the timeline or the map. */
  hover(visit: Visit | null) {
    const before = this.hovered.value;
    if (before?.path !== visit?.path || before?.from !== visit?.from) this.hovered.value = visit;
  }

  /** Set what the pointer is on: the visit of a state at an instant, or nothing. */
  hoverAt(path: string | null, t = this.#playback.nowMs()) {
    const span = path === null ? null : this.#data.run.visitAt(path, t);
    this.hover(span && { path: span.path, from: span.from });
  }

  /** Whether the pointer is on the visit of a state at an instant [ms]. */
  isLit(path: string, t: number) {
    const span = this.hoveredSpan();
    return span?.path === path && t >= span.from && t <= (span.to ?? Infinity);
  }

  /** Handlers for a row about a state at an instant: pointing at it or focusing it highlights the visit. */
  hoverHandlers(path: string, t: number) {
    const enter = () => this.hoverAt(path, t);
    const leave = () => this.hover(null);
    return { onPointerEnter: enter, onPointerLeave: leave, onFocusIn: enter, onFocusOut: leave };
  }

  /** The span of the visit that the pointer is on. */
  hoveredSpan() {
    const visit = this.hovered.value;
    return visit && this.#data.run.spans.findLast((one) => one.path === visit.path && one.from === visit.from);
  }
}
