// The drawn part of the page: the diagram, the timeline with its plots, the map. Carries out the user's actions on the
// view.

import { connect } from "#core/connection.ts";
import { isFile, makeWorker } from "#core/page_file.ts";
import { showPage } from "#core/pages.ts";
import { newest, reproduction } from "#core/reproduction.ts";
import { readToken } from "#core/requests.ts";
import { store } from "#core/store.ts";
import type { Box, Theme } from "#core/types.ts";
import { Address } from "#drawing/address.ts";
import { Diagram } from "#drawing/diagram.ts";
import { LayoutController } from "#drawing/layout_controller.ts";
import { MapView } from "#drawing/map.ts";
import { Minimap } from "#drawing/minimap.ts";
import { Painter } from "#drawing/painter.ts";
import type { Plot } from "#drawing/plot.ts";
import { Scheduler } from "#drawing/scheduler.ts";
import { Strip } from "#drawing/strip.ts";
import { applyTheme, systemIsDark } from "#drawing/theme.ts";
import { Timeline } from "#drawing/timeline.ts";
import { Viewport } from "#drawing/viewport.ts";

export class Page {
  map: MapView;
  diagram: Diagram;
  minimap: Minimap;
  view: Viewport;
  timeline: Timeline;
  strip: Strip;
  plots: Set<Plot> = new Set();
  painter: Painter;
  layouts: LayoutController;
  scheduler: Scheduler;
  address = new Address();
  #hovered: string | null = null; // path of the state in the diagram that the pointer is on
  #followIsSet = false;

  /**
   * @param canvas of the timeline
   * @param floor of the map
   * @param whole of the strip over the whole run
   */
  constructor(
    svg: SVGSVGElement,
    minimap: SVGSVGElement,
    canvas: HTMLCanvasElement,
    floor: HTMLCanvasElement,
    whole: HTMLCanvasElement,
  ) {
    this.map = new MapView(floor);
    this.minimap = new Minimap(minimap, (x, y) => this.view.centre(x, y));
    this.diagram = new Diagram(svg, (path, active) => this.minimap.light(path, active));
    this.view = new Viewport(svg, this.diagram.world, () => {
      this.minimap.showWindow(this.view);
      this.diagram.showScale(this.view.k);
      store.view.scale.value = this.view.k;
    });
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
      if (range) this.timeline.window.show(range);
      else this.timeline.window.fitAll();
      this.timeline.draw();
    });
    this.painter = new Painter(this.diagram);
    this.layouts = new LayoutController(this.diagram, this.minimap, this.view, this.painter);
    this.scheduler = new Scheduler({
      painter: this.painter,
      timeline: this.timeline,
      map: this.map,
      minimap: this.minimap,
      onPanels: () => this.layouts.follow(),
    });
    this.#listen(svg, canvas);
    this.#subscribe();
  }

  /** Listen to the user and to the browser. */
  #listen(svg: SVGSVGElement, canvas: HTMLCanvasElement) {
    svg.addEventListener("click", (e) => {
      if (!this.view.moved) this.select(pathOf(e));
    });
    svg.addEventListener("pointermove", (e) => e.buttons || this.#hover(pathOf(e)));
    svg.addEventListener("pointerleave", () => this.#hover(null));
    svg.addEventListener("dblclick", (e) => this.layouts.toggle(pathOf(e)));
    new ResizeObserver(() => {
      this.layouts.resized();
      this.timeline.draw();
    }).observe(svg);
    new ResizeObserver(() => this.timeline.draw()).observe(canvas);
    const phone = matchMedia("(max-width: 720px), (max-height: 480px)");
    const look = () => {
      store.view.isPhone.value = phone.matches;
    };
    phone.addEventListener("change", look);
    look();
    addEventListener("hashchange", () => {
      readToken();
      this.address.read();
      this.address.show(() => this.timeline.window.fitAll());
      this.layouts.refit();
    });
    systemIsDark.addEventListener("change", () => this.#restyle());
  }

  /** Draw what changes in the store. */
  #subscribe() {
    const { data, view, playback, pointer, clock, notes } = store;
    for (const one of [
      notes.all,
      clock.chosen,
      clock.foldsIdle,
      clock.unfolded,
      view.laneFilter,
      pointer.pointed,
      playback.stretch,
    ])
      one.subscribe(() => this.timeline.draw());
    playback.instant.subscribe(() => {
      this.painter.paintAll();
      this.timeline.draw();
      this.map.draw();
    });
    pointer.hovered.subscribe((visit) => {
      this.diagram.mark(visit ? [visit.path] : [], "linked");
      this.timeline.draw();
      this.map.draw();
    });
    for (const one of [data.serversSeen, data.facts]) one.subscribe(() => this.painter.paintAll());
    data.wayShown.subscribe(() => this.#showWay());
    newest.subscribe(() => {
      const path = reproduction()?.found?.difference?.path;
      if (path && view.reveal(path)) this.layouts.refit();
      this.painter.paintAll();
      this.timeline.draw();
    });
  }

  /** Begin; the elements must be in the document, so that the browser loads their fonts. */
  async start() {
    this.scheduler.start();
    this.layouts.start(await makeWorker("elk"));
    await document.fonts.ready;
    await connect({
      onEvents: (events) => this.scheduler.takeEvents(events),
      onMachine: () => this.showMachine(),
      onObserved: (records) => this.scheduler.takeObserved(records),
      onView: (fragment) => this.address.read(fragment),
    });
  }

  /** Show the machine in the store. */
  showMachine() {
    store.view.selected.value = null;
    this.layouts.restart();
    this.timeline.reset();
    store.notes.load();
    store.panels.loadPlots();
    this.map.reset();
    if (isFile() || store.data.facts.value?.recorded || store.data.run.now.ended != null) this.timeline.window.fitAll();
    if (store.data.settings.value.follow && !this.#followIsSet) {
      store.view.follow.value = true;
      this.#followIsSet = true;
    }
    this.address.show(() => this.timeline.window.fitAll());
    this.layouts.refit();
  }

  /** Open the containers on the way to the end of the run, and highlight that way. */
  #showWay() {
    const way = store.data.wayShown.value;
    const closed = way.map(({ path }) => store.view.reveal(path)).some(Boolean);
    if (closed) this.layouts.refit();
    else if (this.diagram.size) this.diagram.showWay(way);
  }

  /** The title of the view, for a picture. */
  title() {
    return store.data.facts.value?.label ?? "";
  }

  /** A file name for the view, without an extension. */
  fileName() {
    return `${this.title()} ${store.clock.instantText(store.playback.nowMs())}`.replace(/[^\p{L}\p{N}._-]+/gu, "-");
  }

  // -- states -----------------------------------------------------------------------------------

  /** Set the state of the diagram that the pointer is on: its visit is highlighted everywhere. */
  #hover(path: string | null) {
    if (path !== this.#hovered) store.pointer.hoverAt(path);
    this.#hovered = path;
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
    if (store.view.reveal(path)) this.layouts.relayout({ focus: path });
    else this.layouts.focus(path);
  }

  /** Select the neighbour of the selected state in a direction. */
  selectNeighbour(dx: number, dy: number) {
    const from = this.diagram.boxOf(store.view.selected.value);
    if (!from) return;
    const centre = (b: Box) => ({ x: b.x + b.w / 2, y: b.y + Math.min(b.h, 30) / 2 });
    const here = centre(from);
    let best: { path: string; far: number } | null = null;
    for (const [path, box] of this.diagram.picture.boxes) {
      if (path === store.view.selected.value) continue;
      const there = centre(box);
      const along = (there.x - here.x) * dx + (there.y - here.y) * dy;
      const aside = Math.abs((there.x - here.x) * dy) + Math.abs((there.y - here.y) * dx);
      const far = along + 2 * aside;
      if (along > 4 && (!best || far < best.far)) best = { path, far };
    }
    if (best) this.select(best.path);
  }

  markHits(paths: string[]) {
    this.diagram.mark(paths, "hit");
  }

  // -- how it looks -----------------------------------------------------------------------------

  /** @param mode a key of statistics.MODES */
  setNumbers(mode: string) {
    store.view.numbers.value = mode;
    this.painter.showNumbers();
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
}

const pathOf = (e: MouseEvent) =>
  e.target instanceof Element ? (e.target.closest("[data-path]")?.getAttribute("data-path") ?? null) : null;
