// Controls the drawing: passes events to the diagram and timeline at once, and to the panels at a slower pace; carries
// out the user's actions on the view.

import { connect, isFile, makeWorker, messageOf, readToken } from "#core/connection.ts";
import { containerOf, RAISED } from "#core/fold.ts";
import type { LinkedView } from "#core/links.ts";
import { fragmentOf, viewOf } from "#core/links.ts";
import { showPage } from "#core/pages.ts";
import { insideText } from "#core/purposes.ts";
import { newest, reproduction } from "#core/reproduction.ts";
import { numbersFor } from "#core/statistics.ts";
import { store } from "#core/store.ts";
import type { Box, Observed, RunEvent, RunState, StateNode, Theme } from "#core/types.ts";
import { Diagram } from "#drawing/diagram.ts";
import * as framing from "#drawing/framing.ts";
import { Layout } from "#drawing/layout.ts";
import { MapView } from "#drawing/map.ts";
import { boxesOf } from "#drawing/placed.ts";
import type { Plot } from "#drawing/plot.ts";
import { Strip } from "#drawing/strip.ts";
import { applyTheme, systemIsDark } from "#drawing/theme.ts";
import { Timeline } from "#drawing/timeline.ts";
import type { View } from "#drawing/viewport.ts";
import { drag, Viewport } from "#drawing/viewport.ts";

const PANELS_MS = 160; // shortest time between two updates of the panels
const SLOWEST_PANELS_MS = 800;
const IN_TIME_MS = 25; // a frame that comes within this time after its request is not late
const PANELS_PER_LATE = 8; // added to the time between updates of the panels, per ms of lateness [ms]
const LATE_PART = 0.1; // weight of the newest frame in the average lateness
const TEXT_MS = 400; // shortest time between two updates of panels with much text
const BEAT_MS = 200; // time between two updates of what changes without events
const BUSY = 15; // events per second from which transitions do not fade one by one
const ANNOUNCE_MS = 1000;
const OPENING_MS = 15_000; // time after the arrival of a machine in which panels may still appear
const READABLE = 0.55; // scale below which fewer levels are opened at first
const SLOW_MS = 300; // a layout that takes longer shows its progress
const PLAY_MS = 45; // time between two pictures while playing
const ADDRESS_MS = 300; // delay between a change and the update of the address
const BURST = 500; // this many events at once come from a snapshot: their latency is not measured

export class Page {
  map: MapView;
  diagram: Diagram;
  view: Viewport;
  timeline: Timeline;
  strip: Strip;
  changed: Set<string> = new Set(); // paths to paint
  flashes: RunEvent[] = []; // transitions to flash
  frame = 0; // the requested animation frame
  askedAt = 0; // time of that request [ms]
  late = 0; // average lateness of frames [ms]
  playFrame = 0; // the requested animation frame while playing
  playedAt = 0; // [ms]
  drawing: Promise<void> | null = null; // the running layout
  drawAgain = false;
  /** What to show after it. */
  afterLayout: { frame: boolean | "follow"; focus: string | null } = { frame: false, focus: null };
  toggled: string | null = null; // path of the container that is being opened or closed
  fitted: View | null = null; // the view that showed everything
  hovered: string | null = null; // path of the state in the diagram that the pointer is on
  followIsSet = false;
  linked: LinkedView | null = viewOf(location.hash); // the view in the address, until it is shown
  addressDue: ReturnType<typeof setTimeout> | undefined;
  panelsAt = 0; // time of their last update [ms]
  textAt = 0;
  announcedAt = 0;
  newestSeq = 0;
  panelsDue: ReturnType<typeof setTimeout> | 0 = 0;
  mapsDue: ReturnType<typeof setTimeout> | 0 = 0;
  openedAt = 0; // time of the machine's arrival [ms]
  layoutMs = 0; // duration of the last layout
  latencies: number[] = []; // from the event to the paint [ms], for benchmarks
  arrived: number[] = []; // stamps of events to paint
  painting: number[] = []; // stamps of events in the frame that is being painted
  paintPort = new MessageChannel();
  plots: Set<Plot> = new Set();
  layout: Layout | null = null;

  /**
   * @param canvas of the timeline
   */
  constructor(
    svg: SVGSVGElement,
    minimap: SVGSVGElement,
    canvas: HTMLCanvasElement,
    floor: HTMLCanvasElement,
    whole: HTMLCanvasElement,
  ) {
    this.map = new MapView(floor);
    this.diagram = new Diagram(svg, minimap);
    this.view = new Viewport(svg, this.diagram.world, () => this.diagram.showWindow(this.view));
    this.timeline = new Timeline(canvas, {
      onPick: (path) => this.goTo(path),
      onDraw: (range) => {
        for (const plot of this.plots) plot.draw(range);
        this.strip.left = this.timeline.names;
        this.strip.shown = range;
        this.strip.draw();
      },
    });
    this.strip = new Strip(whole, (range) => {
      if (range) this.timeline.showRange(range);
      else {
        this.timeline.fitAll();
        this.timeline.draw();
      }
    });
    this.paintPort.port1.onmessage = () => this.#measureLatency();
    svg.addEventListener("click", (e) => {
      if (!this.view.moved) this.select(pathOf(e));
    });
    svg.addEventListener("pointermove", (e) => e.buttons || this.#hover(pathOf(e)));
    svg.addEventListener("pointerleave", () => this.#hover(null));
    svg.addEventListener("dblclick", (e) => this.#toggle(store.data.model.value?.get(pathOf(e))));
    minimap.addEventListener("pointerdown", (e) => this.#jump(e));
    new ResizeObserver(() => {
      if (this.fitted && this.view.is(this.fitted)) {
        // A view that showed everything does so again. Panels that appear while the page opens change its aspect, so
        // the machine is laid out for the new one.
        if (this.#isOtherShape()) this.refit();
        else this.fit({ animate: false });
      }
      this.diagram.showWindow(this.view);
      this.timeline.draw();
    }).observe(svg);
    const phone = matchMedia("(max-width: 720px), (max-height: 480px)");
    const look = () => {
      store.view.isPhone.value = phone.matches;
    };
    phone.addEventListener("change", look);
    look();
    new ResizeObserver(() => this.timeline.draw()).observe(canvas);
    const { view, playback, panels, notes } = store;
    const chosen = [view.selected, view.opened, notes.all, playback.stretch, panels.arrangement, panels.plotsChosen];
    for (const one of [...chosen, playback.instant]) one.subscribe(() => this.#writeAddress());
    for (const one of [store.notes.all, store.clock.chosen, store.view.laneFilter])
      one.subscribe(() => this.timeline.draw());
    addEventListener("hashchange", () => {
      readToken();
      this.linked = viewOf(location.hash);
      this.#showLinked();
      this.relayout({ frame: true });
    });
    systemIsDark.addEventListener("change", () => this.#restyle());
    store.playback.instant.subscribe(() => {
      this.paintAll();
      this.timeline.draw();
      this.map.draw();
    });
    store.playback.playing.subscribe((playing) => {
      if (playing && !this.playFrame) this.playFrame = requestAnimationFrame((moment) => this.#play(moment));
    });
    store.pointer.hovered.subscribe((visit) => {
      this.diagram.mark(visit ? [visit.path] : [], "linked");
      this.timeline.draw();
      this.map.draw();
    });
    store.pointer.pointed.subscribe(() => this.timeline.draw());
    store.playback.stretch.subscribe(() => this.timeline.draw());
    store.data.serversSeen.subscribe(() => this.paintAll());
    store.data.facts.subscribe(() => this.paintAll());
    store.data.wayShown.subscribe(() => this.#showWay());
    newest.subscribe(() => {
      const path = reproduction()?.found?.difference?.path;
      if (path && store.view.reveal(path)) this.relayout({ frame: true });
      this.paintAll();
      this.timeline.draw();
    });
  }

  /** Begin; the elements must be in the document, so that the browser loads their fonts. */
  async start() {
    setInterval(() => this.#beat(), BEAT_MS);
    this.layout = new Layout(await makeWorker("elk"));
    await document.fonts.ready;
    await connect({
      onEvents: (events) => this.takeEvents(events),
      onMachine: () => this.showMachine(),
      onObserved: (records) => this.takeObserved(records),
    });
  }

  // -- events -------------------------------------------------------------------------------------

  /** Show the machine in the store. */
  showMachine() {
    this.openedAt = performance.now();
    store.view.selected.value = null;
    framing.restart();
    this.layout?.clear();
    this.timeline.reset();
    store.notes.load();
    store.panels.loadPlots();
    this.map.reset();
    if (isFile() || store.data.facts.value?.recorded || store.data.run.now.ended != null) this.timeline.fitAll();
    if (store.data.settings.value.follow && !this.followIsSet) {
      store.view.follow.value = true;
      this.followIsSet = true;
    }
    this.#showLinked();
    this.relayout({ frame: true });
  }

  // -- the address ------------------------------------------------------------------------------

  /** The address of the view. */
  address() {
    const address = new URL(location.href);
    const name = store.data.facts.value?.name;
    if (name && !isFile()) address.searchParams.set("machine", name);
    address.hash = this.#fragment();
    return String(address);
  }

  /** The title of the view, for a picture. */
  title() {
    return store.data.facts.value?.label ?? "";
  }

  /** A file name for the view, without an extension. */
  fileName() {
    return `${this.title()} ${store.clock.instantText(store.playback.nowMs())}`.replace(/[^\p{L}\p{N}._-]+/gu, "-");
  }

  #fragment() {
    const { view, playback, panels, notes } = store;
    const stretch = playback.stretch.value;
    return fragmentOf({
      at: playback.cursor.value,
      selected: view.selected.value,
      opened: [...view.opened.value],
      notes: notes.all.value,
      stretch: stretch && [stretch.from, stretch.to],
      panels: panels.arrangement.value,
      plots: panels.plotsChosen.value,
    });
  }

  /** Write the view into the address, a moment after the last change. */
  #writeAddress() {
    clearTimeout(this.addressDue);
    this.addressDue = setTimeout(() => {
      if (store.data.model.value && !this.linked && store.view.pageShown.value === "machine")
        history.replaceState(null, "", `#${this.#fragment()}`);
    }, ADDRESS_MS);
  }

  /** Show the view of the address, as far as it exists. */
  #showLinked() {
    const model = store.data.model.value;
    const view = this.linked;
    this.linked = null;
    if (!view || !model) return;
    const known = view.opened?.filter((path) => model.get(path)?.children.length);
    if (known?.length) store.view.keepOpened(new Set(known));
    if (view.notes.length) store.notes.add(view.notes);
    if (view.panels) store.panels.arrangement.value = view.panels;
    if (view.stretch) store.playback.selectStretch(...view.stretch);
    if (view.plots) store.panels.plotsChosen.value = view.plots;
    const first = store.data.run.first();
    const isKept =
      first !== null && view.at !== null && view.at >= first && view.at <= (store.data.run.last() ?? first) + 1;
    if (isKept) {
      this.timeline.fitAll();
      store.playback.seek(view.at);
    } else if (view.at !== null) store.view.notify("The instant of this link is not in this run", "error");
    if (view.selected === null) return;
    if (model.get(view.selected)) {
      store.view.selected.value = view.selected;
      store.view.reveal(view.selected);
    } else store.view.notify("The state of this link is not in this machine", "error");
  }

  takeEvents(events: RunEvent[]) {
    const live = store.playback.cursor.value === null && !document.hidden; // a hidden page draws no frames
    for (const e of events) {
      this.changed.add(e.path);
      if (live && ["Left", "Failed", "Fired"].includes(e.kind)) this.flashes.push(e);
      if (live && events.length < BURST) this.arrived.push(e.stamp_ns / 1e6);
    }
    store.addEvents(events);
    if (!events.length) this.paintAll();
    this.#schedule();
  }

  takeObserved(records: Observed[]) {
    store.data.addObserved(records);
    this.#schedule();
  }

  #schedule() {
    if (this.frame) return;
    this.askedAt = performance.now();
    this.frame = requestAnimationFrame(() => this.#draw());
  }

  /** Time between two updates of the panels [ms]; longer on a slow browser, as the diagram has priority. */
  get #panelsPause() {
    return Math.min(SLOWEST_PANELS_MS, PANELS_MS + PANELS_PER_LATE * Math.max(0, this.late - IN_TIME_MS));
  }

  #draw() {
    this.frame = 0;
    const moment = performance.now();
    this.late += LATE_PART * (moment - this.askedAt - this.late);
    // Changes from before a look back must not be painted after the return to live.
    const flashes = this.flashes.splice(0);
    const arrived = this.arrived.splice(0);
    if (store.playback.cursor.value === null) {
      const now = store.playback.nowMs();
      for (const path of this.changed) this.#paint(path, store.data.run.now, now);
      this.changed.clear();
      for (const e of flashes)
        if (e.kind === "Fired") this.diagram.flashFired(e.path, e.transition, moment);
        else this.diagram.flash(e.path, e.kind === "Left" ? e.outcome : RAISED, moment);
      if (arrived.length) {
        this.painting.push(...arrived);
        this.paintPort.port2.postMessage(0);
      }
    }
    if (this.diagram.endFlashes(moment)) this.#schedule();
    const pause = this.#panelsPause;
    if (moment - this.panelsAt > pause) this.#panels(moment);
    else this.panelsDue ||= setTimeout(() => this.#panels(performance.now()), pause);
  }

  #play(moment: number) {
    this.playFrame = 0;
    if (!store.playback.playing.value) return;
    this.playFrame = requestAnimationFrame((next) => this.#play(next));
    if (moment - this.playedAt < PLAY_MS) return;
    this.playedAt = moment;
    store.playback.playOn(performance.now());
  }

  #measureLatency() {
    const now = performance.timeOrigin + performance.now();
    for (const stamp of this.painting.splice(0)) this.latencies.push(now - stamp);
    if (this.latencies.length > 20_000) this.latencies.splice(0, 10_000);
  }

  #panels(moment: number) {
    clearTimeout(this.panelsDue);
    this.panelsDue = 0;
    this.panelsAt = moment;
    store.playback.tick.value += 1;
    store.panels.hasMap.value = !store.data.scene.isEmpty;
    if (moment - this.textAt > TEXT_MS) {
      this.textAt = moment;
      store.playback.slowTick.value += 1;
      const newest = store.data.run.events.at(-1)?.seq ?? 0;
      const isBusy = newest - this.newestSeq > 3 * BUSY * (TEXT_MS / 1000);
      this.newestSeq = newest;
      this.diagram.svg.classList.toggle("busy", isBusy);
      this.timeline.tellInstant();
    }
    // Not in one long task, which would block input.
    this.mapsDue ||= setTimeout(() => {
      this.mapsDue = 0;
      this.timeline.draw();
      this.map.draw();
      this.diagram.paintMinimap();
    }, PANELS_MS / 2);
    this.#announce(moment);
    this.#follow();
  }

  /** Update what changes without events: clocks, the stale badge, closed containers. */
  #beat() {
    const data = store.playback.shown();
    const now = store.playback.nowMs();
    if (store.playback.cursor.value === null)
      for (const path of store.status.activePaths.value) {
        const state = data.states[path];
        if (state) this.diagram.updateBadge(path, state, now);
      }
    if (store.playback.cursor.value === null) this.diagram.paintCards(insideText);
    if (store.view.numbers.value !== "none") this.#showNumbers();
    this.#panels(performance.now());
  }

  /** Announce the running states to screen readers. */
  #announce(moment: number) {
    const region = document.getElementById("announced");
    if (!region || moment - this.announcedAt < ANNOUNCE_MS) return;
    const names = store.status.activeLeaves.value
      .slice(0, 6)
      .map((path) => store.data.nameOf(path))
      .join(", ");
    const text = [store.status.runStatus.value.word, names].filter(Boolean).join(": ");
    if (region.textContent === text) return;
    region.textContent = text;
    this.announcedAt = moment;
  }

  #paint(path: string, data: RunState, now: number) {
    this.diagram.paintJoins(path, data.states);
    this.diagram.paintJoins(containerOf(path), data.states);
    this.diagram.paintNet(path, data.states[path]);
    if (!this.diagram.states.has(path)) return;
    const goal = Object.values(data.goals).findLast((one) => one.path === path && one.ended == null);
    this.diagram.paint(path, data.states[path], now, goal, store.status.hasNoServer(goal));
  }

  paintAll() {
    if (!this.diagram.size) return;
    const data = store.playback.shown();
    const now = store.playback.nowMs();
    const running = Object.values(data.goals).filter((goal) => goal.ended == null);
    const goals = new Map(running.map((goal) => [goal.path, goal]));
    for (const path of this.diagram.boxes.keys()) {
      const goal = goals.get(path);
      this.diagram.paint(path, data.states[path], now, goal, store.status.hasNoServer(goal));
    }
    for (const path of this.diagram.joins.keys()) this.diagram.paintJoins(path, data.states);
    this.diagram.paintCards(insideText);
    for (const path of this.diagram.boxes.keys()) this.diagram.paintNet(path, data.states[path]);
    const stops = store.data.facts.value?.control?.breakpoints ?? [];
    const pathsOf = (some: typeof stops) => some.map(([path]) => path);
    this.diagram.mark(pathsOf(stops.filter(([, outcome]) => outcome === null)), "stopped");
    this.diagram.mark(pathsOf(stops.filter(([, outcome]) => outcome !== null)), "stopped-after");
    this.diagram.mark(store.view.selected.value ? [store.view.selected.value] : [], "selected");
    const differing = reproduction()?.found?.difference?.path;
    this.diagram.mark(differing ? [differing] : [], "differs");
    this.diagram.showWay(store.data.wayShown.value);
    this.#showNumbers();
  }

  /** Open the containers on the way to the end of the run, and highlight that way. */
  #showWay() {
    const closed = store.data.wayShown.value.map(({ path }) => store.view.reveal(path)).some(Boolean);
    if (closed) this.relayout({ frame: true });
    else if (this.diagram.size) this.diagram.showWay(store.data.wayShown.value);
  }

  #showNumbers() {
    const { statistics, model } = store.data;
    const { countOf, heatOf } = numbersFor(
      store.view.numbers.value,
      store.playback.shown().states,
      statistics.value,
      model.value,
    );
    this.diagram.showNumbers(countOf, heatOf);
  }

  // -- layout -------------------------------------------------------------------------------------

  /** Lay out and draw the machine; then show all of it, the running states, or one state. */
  relayout({ frame = false, focus = null }: { frame?: boolean | "follow"; focus?: string | null } = {}) {
    if (frame) this.afterLayout.frame = frame;
    this.afterLayout.focus = focus ?? this.afterLayout.focus;
    if (this.drawing) this.drawAgain = true;
    else this.drawing = this.#layoutLoop();
    return this.drawing;
  }

  async #layoutLoop() {
    try {
      do {
        this.drawAgain = false;
        await this.#layoutOnce();
        if (this.afterLayout.frame === true && this.#isOtherShape()) this.drawAgain = true;
      } while (this.drawAgain);
      const { frame, focus } = this.afterLayout;
      this.afterLayout = { frame: false, focus: null };
      const size = this.diagram.size;
      if (focus) this.#focus(focus);
      else if (frame === "follow" && size)
        this.view.frame(framing.boxToFrame(this.diagram, this.view, size), { most: 1.5 });
      else if (frame) this.fit({ animate: false });
      const { dataset } = document.documentElement;
      dataset.drawn = String(Number(dataset.drawn ?? 0) + 1);
      store.data.failure.value = null;
    } catch (error) {
      const text = `This machine could not be laid out: ${messageOf(error)}`;
      if (this.diagram.size)
        store.view.notify(text, "error"); // the old drawing stays
      else store.data.failure.value = text;
      console.error(error);
    } finally {
      this.drawing = null;
    }
  }

  async #layoutOnce() {
    const model = store.data.model.value;
    if (!model || !this.layout) return;
    const begun = performance.now();
    if (this.afterLayout.frame) this.layout.choose(this.view.width / this.view.height);
    const progress = (done: number, all: number) => {
      if (performance.now() - begun > SLOW_MS) store.view.laidOut.value = { done, all };
    };
    let open = new Set(store.view.opened.value).add(model.root.path);
    let result = await this.layout.run(model.root, open, progress);
    if (this.afterLayout.frame === "follow")
      while (result && !framing.isLegible(boxesOf(result), this.view)) {
        const less = framing.oneLevelLess(open);
        if (!less) break;
        open = less;
        store.view.opened.value = less;
        result = await this.layout.run(model.root, less, progress);
      }
    store.view.laidOut.value = null;
    store.view.overview.value = Boolean(result?.isOverview);
    this.layoutMs = performance.now() - begun;
    if (!result || model !== store.data.model.value) return;
    const anchor = this.#anchor();
    this.diagram.draw(result, model, store.data.problems.value);
    this.#hold(anchor);
    this.paintAll();
    const size = this.diagram.size;
    const tooSmall = size !== null && this.view.scaleFor(size) < READABLE;
    if (this.afterLayout.frame === true && tooSmall && store.view.openOneLevelLess()) this.drawAgain = true;
  }

  /** Keep the state in the middle of the view at its place while a layout moves the others. */
  #anchor() {
    const { view, diagram } = this;
    if (!diagram.size) return null;
    const x = (view.width / 2 - view.x) / view.k;
    const y = (view.height / 2 - view.y) / view.k;
    const inside = (b: Box) => x >= b.x && x <= b.x + b.w && y >= b.y && y <= b.y + b.h;
    const path = this.toggled ?? [...diagram.boxes].findLast(([, box]) => inside(box))?.[0] ?? null;
    this.toggled = null;
    const box = diagram.boxOf(path);
    return path !== null && box ? { path, x: box.x, y: box.y } : null;
  }

  #hold(anchor: { path: string; x: number; y: number } | null) {
    const box = anchor && this.diagram.boxOf(anchor.path);
    if (!box) return;
    const { x, y, k } = this.view;
    this.view.set(x - (box.x - anchor.x) * k, y - (box.y - anchor.y) * k, k);
  }

  #focus(path: string) {
    const box = this.diagram.boxOf(path);
    if (box) this.view.frame(box, { margin: 110, most: Math.max(1, Math.min(this.view.k, 1.5)) });
  }

  #follow() {
    if (!store.view.follow.value || this.drawing) return;
    const open = framing.containersToOpen(store.playback.nowMs());
    if (!open) return;
    store.view.opened.value = open;
    this.relayout({ frame: "follow" });
  }

  /** Whether the page is just opening and the aspect of its view has changed much since the layout. */
  #isOtherShape() {
    const isOpening = performance.now() - this.openedAt < OPENING_MS;
    return isOpening && this.layout !== null && !this.layout.suits(this.view.width / this.view.height);
  }

  /** Show everything, with a layout for the present size of the view. */
  refit() {
    this.relayout({ frame: true });
  }

  fit({ animate = true } = {}) {
    if (this.diagram.size) this.fitted = this.view.frame(this.diagram.size, { animate, most: 1.5 });
  }

  // -- input --------------------------------------------------------------------------------------

  /** Set the state of the diagram that the pointer is on: its visit is highlighted everywhere. */
  #hover(path: string | null) {
    if (path !== this.hovered) store.pointer.hoverAt(path);
    this.hovered = path;
  }

  select(path: string | null) {
    store.view.selected.value = path;
    this.diagram.mark(path ? [path] : [], "selected");
    this.timeline.draw();
  }

  /** Select a state and bring it into view. */
  goTo(path: string) {
    showPage("machine");
    this.select(path);
    store.view.part.value = "machine";
    if (store.view.reveal(path)) this.relayout({ focus: path });
    else this.#focus(path);
  }

  /** Select the neighbour of the selected state in a direction. */
  selectNeighbour(dx: number, dy: number) {
    const from = this.diagram.boxOf(store.view.selected.value);
    if (!from) return;
    const centre = (b: Box) => ({ x: b.x + b.w / 2, y: b.y + Math.min(b.h, 30) / 2 });
    const here = centre(from);
    let best: { path: string; far: number } | null = null;
    for (const [path, box] of this.diagram.boxes) {
      if (path === store.view.selected.value) continue;
      const there = centre(box);
      const along = (there.x - here.x) * dx + (there.y - here.y) * dy;
      const aside = Math.abs((there.x - here.x) * dy) + Math.abs((there.y - here.y) * dx);
      const far = along + 2 * aside;
      if (along > 4 && (!best || far < best.far)) best = { path, far };
    }
    if (best) this.select(best.path);
  }

  toggleSelected() {
    this.#toggle(store.data.model.value?.get(store.view.selected.value));
  }

  /** Open or close a container, unless it is the root. */
  #toggle(node: StateNode | undefined) {
    if (store.view.overview.value && node) {
      store.view.openAround(node);
      this.relayout({ focus: node.path });
      return;
    }
    if (!node?.children.length || !node.parent) return;
    this.toggled = node.path;
    store.view.toggle(node.path);
    this.relayout();
  }

  setFollow(on: boolean) {
    store.view.follow.value = on;
    framing.restart();
    if (on) this.#follow();
  }

  setDepth(levels: number) {
    const model = store.data.model.value;
    if (!model) return;
    store.view.follow.value = false;
    store.view.setOpened(model.toDepth(levels));
    this.relayout({ frame: true });
  }

  setImplicit(on: boolean) {
    store.view.setImplicit(on);
    this.layout?.clear();
    this.relayout();
  }

  /** @param mode a key of statistics.MODES */
  setNumbers(mode: string) {
    store.view.numbers.value = mode;
    this.#showNumbers();
  }

  setTheme(name: Theme) {
    store.view.theme.value = name;
    applyTheme();
    this.#restyle();
  }

  #restyle() {
    this.timeline.restyle();
    this.strip.restyle();
    for (const plot of this.plots) plot.restyle();
    this.map.restyle();
    this.timeline.draw();
    this.map.draw();
  }

  addPlot(plot: Plot) {
    this.plots.add(plot);
    this.timeline.draw();
  }

  removePlot(plot: Plot) {
    this.plots.delete(plot);
    plot.destroy();
  }

  markHits(paths: string[]) {
    this.diagram.mark(paths, "hit");
  }

  /** Show the place in the minimap that is pressed. */
  #jump(pressed: PointerEvent) {
    const move = (e: PointerEvent) => {
      const matrix = this.diagram.minimap.getScreenCTM();
      if (!matrix) return;
      const point = new DOMPoint(e.clientX, e.clientY).matrixTransform(matrix.inverse());
      this.view.centre(point.x, point.y);
    };
    drag(move);
    move(pressed);
  }
}

const pathOf = (e: MouseEvent) =>
  e.target instanceof Element ? (e.target.closest("[data-path]")?.getAttribute("data-path") ?? null) : null;
