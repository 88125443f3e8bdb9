// Lays out the machine with the containers that are open, draws it, and brings into view what was asked for.

import { messageOf } from "#core/requests.ts";
import { store } from "#core/store.ts";
import type { Box } from "#core/types.ts";
import type { Diagram } from "#drawing/diagram.ts";
import { boxToFrame, Follow, isLegible, oneLevelLess } from "#drawing/follow.ts";
import { Layout } from "#drawing/layout.ts";
import type { Minimap } from "#drawing/minimap.ts";
import { overview } from "#drawing/overview.ts";
import type { Painter } from "#drawing/painter.ts";
import { boxesOf } from "#drawing/placed.ts";
import type { View, Viewport } from "#drawing/viewport.ts";

const OPENING_MS = 15_000; // time after the arrival of a machine in which panels may still appear
const READABLE = 0.75; // scale below which fewer levels are opened at first: names have 8 px there
const TILES_MS = 100; // a machine whose first layout takes longer is shown as tiles meanwhile
const SLOW_MS = 300; // a layout that takes longer shows its progress
const LARGEST = 1.5; // scale to which a small machine is enlarged

export class LayoutController {
  diagram: Diagram;
  minimap: Minimap;
  view: Viewport;
  painter: Painter;
  layout: Layout | null = null;
  running: Promise<void> | null = null;
  ms = 0; // duration of the last layout
  openedAt = 0; // time of the machine's arrival [ms]
  fitted: View | null = null; // the view that showed everything
  #again = false;
  #isNew = true; // whether ELK has laid out nothing of the machine yet
  #tiles: ReturnType<typeof setTimeout> | undefined;
  /** What to show after it. */
  #after: { frame: boolean | "follow"; focus: string | null } = { frame: false, focus: null };
  #toggled: string | null = null; // path of the container that is being opened or closed
  #follow = new Follow();

  constructor(diagram: Diagram, minimap: Minimap, view: Viewport, painter: Painter) {
    this.diagram = diagram;
    this.minimap = minimap;
    this.view = view;
    this.painter = painter;
  }

  /** @param worker of ELK */
  start(worker: Worker) {
    this.layout = new Layout(worker);
  }

  /** Another machine has come. */
  restart() {
    this.openedAt = performance.now();
    this.#isNew = true;
    this.#follow.restart();
    this.layout?.clear();
  }

  /** Lay out and draw the machine; then show all of it, the running states, or one state. */
  relayout({ frame = false, focus = null }: { frame?: boolean | "follow"; focus?: string | null } = {}) {
    if (frame) this.#after.frame = frame;
    this.#after.focus = focus ?? this.#after.focus;
    if (this.running) this.#again = true;
    else this.running = this.#loop();
    return this.running;
  }

  async #loop() {
    try {
      do {
        this.#again = false;
        await this.#once();
        if (this.#after.frame === true && this.isOtherShape()) this.#again = true;
      } while (this.#again);
      this.#show();
      const { dataset } = document.documentElement;
      dataset.drawn = String(Number(dataset.drawn ?? 0) + 1);
      store.data.failure.value = null;
    } catch (error) {
      const text = `This machine could not be laid out: ${messageOf(error)}`;
      if (this.#isNew) {
        clearTimeout(this.#tiles);
        this.#drawTiles();
        store.data.failure.value = `${text}. You see its states without their arrows.`;
      } else store.view.notify(text, "error"); // the old drawing stays
      console.error(error);
    } finally {
      this.running = null;
    }
  }

  async #once() {
    const model = store.data.model.value;
    if (!model || !this.layout) return;
    const begun = performance.now();
    if (this.#after.frame) this.layout.choose(this.view.aspect);
    const progress = (done: number, all: number) => {
      if (performance.now() - begun > SLOW_MS) store.view.laidOut.value = { done, all };
    };
    let open = new Set(store.view.opened.value).add(model.root.path);
    if (this.#isNew) this.#tiles = setTimeout(() => this.#drawTiles(), TILES_MS);
    let result = await this.layout.run(model.root, open, progress, store.view.outline.value);
    if (this.#after.frame === "follow")
      while (result && !isLegible(boxesOf(result), this.view)) {
        const less = oneLevelLess(open);
        if (!less) break;
        open = less;
        store.view.opened.value = less;
        result = await this.layout.run(model.root, less, progress);
      }
    store.view.laidOut.value = null;
    store.view.overview.value = Boolean(result?.isOverview);
    this.ms = performance.now() - begun;
    if (!result || model !== store.data.model.value) return;
    clearTimeout(this.#tiles);
    this.#isNew = false;
    const anchor = this.#anchor();
    this.diagram.draw(result, model, store.data.problems.value);
    this.minimap.draw(this.diagram.picture);
    this.#hold(anchor);
    this.painter.paintAll();
    const size = this.diagram.size;
    const tooSmall = size !== null && this.view.scaleFor(size) < READABLE;
    if (this.#after.frame === true && tooSmall && store.view.openOneLevelLess()) this.#again = true;
  }

  /** Show the states as tiles without arrows, for which no ELK is needed: it takes seconds to begin. */
  #drawTiles() {
    const model = store.data.model.value;
    if (!model || !this.#isNew) return;
    const open = new Set(store.view.opened.value).add(model.root.path);
    this.diagram.draw(overview(model.root, open, this.view.aspect), model, store.data.problems.value);
    this.minimap.draw(this.diagram.picture);
    this.painter.paintAll();
    this.fit({ animate: false });
  }

  /** Bring into view what was asked for. */
  #show() {
    const { frame, focus } = this.#after;
    const { size } = this.diagram;
    this.#after = { frame: false, focus: null };
    if (focus) this.focus(focus);
    else if (frame === "follow" && size) this.view.frame(boxToFrame(this.diagram, this.view, size), { most: LARGEST });
    else if (frame) this.fit({ animate: false });
  }

  /** The state in the middle of the view, and its place: it keeps it while a layout moves the others. */
  #anchor() {
    const { view, diagram } = this;
    if (!diagram.size) return null;
    const x = (view.width / 2 - view.x) / view.k;
    const y = (view.height / 2 - view.y) / view.k;
    const inside = (b: Box) => x >= b.x && x <= b.x + b.w && y >= b.y && y <= b.y + b.h;
    const path = this.#toggled ?? [...diagram.picture.boxes].findLast(([, box]) => inside(box))?.[0] ?? null;
    this.#toggled = null;
    const box = diagram.boxOf(path);
    return path !== null && box ? { path, x: box.x, y: box.y } : null;
  }

  #hold(anchor: { path: string; x: number; y: number } | null) {
    const box = anchor && this.diagram.boxOf(anchor.path);
    if (!box) return;
    const { x, y, k } = this.view;
    this.view.set(x - (box.x - anchor.x) * k, y - (box.y - anchor.y) * k, k);
  }

  // -- what is in view --------------------------------------------------------------------------

  focus(path: string) {
    const box = this.diagram.boxOf(path);
    if (box) this.view.frame(box, { margin: 110, most: Math.max(1, Math.min(this.view.k, LARGEST)) });
  }

  fit({ animate = true } = {}) {
    if (this.diagram.size) this.fitted = this.view.frame(this.diagram.size, { animate, most: LARGEST });
  }

  /** Show everything, with a layout for the present size of the view. */
  refit() {
    this.relayout({ frame: true });
  }

  /**
   * Show everything again after the view was resized, if it did before. Panels that appear while the page opens change
   * its aspect, so the machine is laid out for the new one.
   */
  resized() {
    if (this.fitted && this.view.is(this.fitted)) {
      if (this.isOtherShape()) this.refit();
      else this.fit({ animate: false });
    }
    this.minimap.showWindow(this.view);
  }

  /** Whether the page is just opening and the aspect of its view has changed much since the layout. */
  isOtherShape() {
    const isOpening = performance.now() - this.openedAt < OPENING_MS;
    return isOpening && this.layout !== null && !this.layout.suits(this.view.aspect);
  }

  // -- the open containers ----------------------------------------------------------------------

  /** Open or close a container, unless it is the root. */
  toggle(path: string | null) {
    const node = store.data.model.value?.get(path);
    if (store.view.overview.value && node) {
      store.view.openAround(node);
      this.relayout({ focus: node.path });
      return;
    }
    if (!node?.children.length || !node.parent) return;
    this.#toggled = node.path;
    store.view.toggle(node.path);
    this.relayout();
  }

  setDepth(levels: number) {
    const model = store.data.model.value;
    if (!model) return;
    store.view.follow.value = false;
    store.view.setOpened(model.toDepth(levels));
    this.relayout({ frame: true });
  }

  /** Show the outermost level with larger names: with its arrows, then as tiles without; or show the arrows again. */
  toggleOutline() {
    const { view } = store;
    if (view.opened.value.size > 1) {
      this.setDepth(1);
      return;
    }
    view.follow.value = false;
    view.outline.value = !view.outline.value;
    this.refit();
  }

  setImplicit(on: boolean) {
    store.view.setImplicit(on);
    this.layout?.clear();
    this.relayout();
  }

  setFollow(on: boolean) {
    store.view.follow.value = on;
    store.view.outline.value = false;
    this.#follow.restart();
    this.follow();
  }

  /** In follow mode, open the containers that run and frame what runs in them. */
  follow() {
    if (!store.view.follow.value || this.running) return;
    const open = this.#follow.containersToOpen(store.playback.nowMs());
    if (!open) return;
    store.view.opened.value = open;
    this.relayout({ frame: "follow" });
  }
}
