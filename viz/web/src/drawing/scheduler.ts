// When what is drawn: events at the next frame, the panels at a slower pace, clocks with a beat, and instants while the
// run is played.

import { store } from "#core/store.ts";
import type { Observed, RunEvent } from "#core/types.ts";
import type { MapView } from "#drawing/map.ts";
import type { Minimap } from "#drawing/minimap.ts";
import type { Painter } from "#drawing/painter.ts";
import type { Timeline } from "#drawing/timeline.ts";

const PANELS_MS = 160; // shortest time between two updates of the panels
const SLOWEST_PANELS_MS = 800;
const IN_TIME_MS = 25; // a frame that comes within this time after its request is not late
const PANELS_PER_LATE = 8; // added to the time between updates of the panels, per ms of lateness [ms]
const LATE_PART = 0.1; // weight of the newest frame in the average lateness
const TEXT_MS = 400; // shortest time between two updates of panels with much text
const BEAT_MS = 200; // time between two updates of what changes without events
const BUSY = 15; // events per second from which transitions do not fade one by one
const ANNOUNCE_MS = 1000;
const PLAY_MS = 45; // time between two pictures while playing
const BURST = 500; // this many events at once come from a snapshot: their latency is not measured
const FLASHING = ["Left", "Failed", "Fired"]; // kinds of events with a transition

/** what is drawn; `onPanels` is called with each update of the panels */
type Drawn = { painter: Painter; timeline: Timeline; map: MapView; minimap: Minimap; onPanels: () => void };

export class Scheduler {
  frame = 0; // the requested animation frame
  changed: Set<string> = new Set(); // paths to paint in it
  flashes: RunEvent[] = []; // transitions to flash in it
  latency = new Latency();
  #drawn: Drawn;
  #askedAt = 0; // time of the request [ms]
  #late = 0; // average lateness of frames [ms]
  #playFrame = 0; // the requested animation frame while playing
  #playedAt = 0; // [ms]
  #panelsAt = 0; // time of their last update [ms]
  #panelsDue: ReturnType<typeof setTimeout> | 0 = 0;
  #textAt = 0;
  #drawDue: ReturnType<typeof setTimeout> | 0 = 0;
  #announcedAt = 0;
  #newestSeq = 0;

  constructor(drawn: Drawn) {
    this.#drawn = drawn;
    store.playback.playing.subscribe((playing) => {
      if (playing && !this.#playFrame) this.#playFrame = requestAnimationFrame((moment) => this.#play(moment));
    });
  }

  start() {
    setInterval(() => {
      this.#drawn.painter.paintBeat();
      this.#panels(performance.now());
    }, BEAT_MS);
  }

  takeEvents(events: RunEvent[]) {
    const live = store.playback.cursor.value === null && !document.hidden; // a hidden page draws no frames
    for (const e of events) {
      this.changed.add(e.path);
      if (live && FLASHING.includes(e.kind)) this.flashes.push(e);
      if (live && events.length < BURST) this.latency.arrived.push(e.stamp_ns / 1e6);
    }
    store.addEvents(events);
    if (!events.length) this.#drawn.painter.paintAll();
    this.#schedule();
  }

  takeObserved(records: Observed[]) {
    store.data.addObserved(records);
    this.#schedule();
  }

  #schedule() {
    if (this.frame) return;
    this.#askedAt = performance.now();
    this.frame = requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.frame = 0;
    const moment = performance.now();
    this.#late += LATE_PART * (moment - this.#askedAt - this.#late);
    // Changes from before a look back must not be painted after the return to live.
    const flashes = this.flashes.splice(0);
    const arrived = this.latency.arrived.splice(0);
    if (store.playback.cursor.value === null) {
      this.#drawn.painter.paintChanged(this.changed);
      this.changed.clear();
      this.#drawn.painter.flash(flashes, moment);
      this.latency.painting(arrived);
    }
    if (this.#drawn.painter.diagram.endFlashes(moment)) this.#schedule();
    const pause = this.#panelsPause;
    if (moment - this.#panelsAt > pause) this.#panels(moment);
    else this.#panelsDue ||= setTimeout(() => this.#panels(performance.now()), pause);
  }

  /** Time between two updates of the panels [ms]; longer on a slow browser, as the diagram has priority. */
  get #panelsPause() {
    return Math.min(SLOWEST_PANELS_MS, PANELS_MS + PANELS_PER_LATE * Math.max(0, this.#late - IN_TIME_MS));
  }

  #panels(moment: number) {
    clearTimeout(this.#panelsDue);
    this.#panelsDue = 0;
    this.#panelsAt = moment;
    store.playback.update();
    store.panels.hasMap.value = !store.data.scene.isEmpty;
    if (moment - this.#textAt > TEXT_MS) {
      this.#textAt = moment;
      store.playback.updateSlow();
      const newest = store.data.run.events.at(-1)?.seq ?? 0;
      const isBusy = newest - this.#newestSeq > 3 * BUSY * (TEXT_MS / 1000);
      this.#newestSeq = newest;
      this.#drawn.painter.diagram.svg.classList.toggle("busy", isBusy);
      this.#drawn.timeline.tellInstant();
    }
    // Not in one long task, which would block input.
    this.#drawDue ||= setTimeout(() => {
      this.#drawDue = 0;
      this.#drawn.timeline.draw();
      this.#drawn.map.draw();
      this.#drawn.minimap.paint();
    }, PANELS_MS / 2);
    this.#announce(moment);
    this.#drawn.onPanels();
  }

  /** Announce the running states to screen readers. */
  #announce(moment: number) {
    const region = document.getElementById("announced");
    if (!region || moment - this.#announcedAt < ANNOUNCE_MS) return;
    const leaves = store.status.activeLeaves.value.slice(0, 6);
    const names = leaves.map((path) => store.data.nameOf(path)).join(", ");
    const text = [store.status.runStatus.value.word, names].filter(Boolean).join(": ");
    if (region.textContent === text) return;
    region.textContent = text;
    this.#announcedAt = moment;
  }

  #play(moment: number) {
    this.#playFrame = 0;
    if (!store.playback.playing.value) return;
    this.#playFrame = requestAnimationFrame((next) => this.#play(next));
    if (moment - this.#playedAt < PLAY_MS) return;
    this.#playedAt = moment;
    store.playback.playOn(performance.now());
  }
}

/** The time from an event to its paint, for benchmarks. */
class Latency {
  arrived: number[] = []; // stamps of events to paint
  measured: number[] = []; // [ms]
  #painting: number[] = []; // stamps of events in the frame that is being painted
  #port = new MessageChannel(); // its message comes after the paint

  constructor() {
    this.#port.port1.onmessage = () => {
      const now = performance.timeOrigin + performance.now();
      for (const stamp of this.#painting.splice(0)) this.measured.push(now - stamp);
      if (this.measured.length > 20_000) this.measured.splice(0, 10_000);
    };
  }

  /** @param stamps of the events that are painted in this frame */
  painting(stamps: number[]) {
    if (!stamps.length) return;
    this.#painting.push(...stamps);
    this.#port.port2.postMessage(0);
  }
}
