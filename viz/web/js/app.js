// Puts the page together: the diagram outside the virtual DOM, the panels inside it.
import { h, render } from "preact";
import { useEffect, useRef } from "preact/hooks";
import htm from "htm";
import "@preact/signals";
import * as store from "viewer/store";
import * as follow from "viewer/follow";
import { connect, isFile, makeWorker } from "viewer/source";
import { Diagram } from "viewer/diagram";
import { Viewport } from "viewer/viewport";
import { Layout } from "viewer/layout";
import { Timeline } from "viewer/timeline";
import { Inspector, holdText } from "viewer/inspector";
import { listen } from "viewer/keys";
import { Empty, Help, Legend, Notice, TopBar, Tree } from "viewer/panels";
import { ActionsPage } from "viewer/actions";
import { weights } from "viewer/statistics";
import { askerText, ms } from "viewer/fold";
import { shorten } from "viewer/model";

const html = htm.bind(h);
const PANELS_MS = 160; // the panels are drawn again at most so often
const WORDS_MS = 400; // and the inspector
const BUSY = 15; // transitions in a second from which they do not fade one by one
const ANNOUNCE_MS = 1000;
const READABLE = 0.55; // the scale below which fewer levels are opened at first

class Page {
  constructor() {
    this.dirty = new Set();
    this.flashes = [];
    this.frame = 0;
    this.drawing = null;
    this.panelsAt = 0;
    this.announcedAt = 0;
    this.latencies = []; // from the event to the paint [ms], for measuring
    this.paintPort = new MessageChannel();
    this.paintPort.port1.onmessage = () => {
      const now = performance.timeOrigin + performance.now();
      for (const stamp of this.pending ?? []) this.latencies.push(now - stamp);
      this.pending = null;
      if (this.latencies.length > 20_000) this.latencies.splice(0, 10_000);
    };
  }

  attach(svg, minimap, canvas) {
    this.diagram = new Diagram(svg, minimap);
    this.view = new Viewport(svg, this.diagram.world, () => this.diagram.showWindow(this.view));
    this.timeline = new Timeline(canvas, { onPick: (path) => this.goTo(path, { keepTime: true }) });
    svg.addEventListener("click", (e) => this.#click(e));
    svg.addEventListener("dblclick", (e) => this.#open(e));
    minimap.addEventListener("pointerdown", (e) => this.#jump(e));
    new ResizeObserver(() => {
      if (this.fitted && this.view.is(this.fitted)) this.fit({ fly: false }); // who saw all sees all again
      this.diagram.showWindow(this.view);
      this.timeline.draw();
    }).observe(svg);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.timeline.restyle());
    listen(this);
    setInterval(() => this.#beat(), 200);
    this.ready = this.#start();
  }

  async #start() {
    this.layout = new Layout(await makeWorker());
    await document.fonts.ready;
    await connect({ onEvents: (events) => this.take(events), onMachine: () => this.newMachine() });
  }

  // -- what happens -------------------------------------------------------------------------------

  newMachine() {
    store.selected.value = null;
    follow.restart();
    this.layout.clear();
    this.timeline.reset();
    if (isFile() || store.facts.value?.recorded) this.timeline.fitAll();
    if (store.settings.value.follow && !this.followSet) { store.follow.value = true; this.followSet = true; }
    document.title = `${store.facts.value.label} \u2013 smachpy`;
    this.relayout({ frame: true });
  }

  take(events) {
    const live = store.cursor.value === null;
    for (const e of events) {
      this.dirty.add(e.path);
      if (live && (e.kind === "Left" || e.kind === "Failed")) this.flashes.push(e);
    }
    store.take(events);
    if (events.length && events.length < 500 && live) this.arrived = (this.arrived ?? []).concat(events.map((e) => ms(e.stamp_ns)));
    if (!events.length) this.paintAll();
    this.#schedule();
  }

  #schedule() { if (!this.frame) this.frame = requestAnimationFrame(() => this.#draw()); }

  #draw() {
    this.frame = 0;
    const moment = performance.now();
    if (store.cursor.value === null) {
      const now = store.nowMs(), data = store.run.now;
      for (const path of this.dirty) this.#paint(path, data, now);
      this.dirty.clear();
      for (const e of this.flashes.splice(0)) this.diagram.flash(e.path, e.outcome ?? "exception", moment);
      if (this.arrived) {
        this.pending = (this.pending ?? []).concat(this.arrived);
        this.arrived = null;
        this.paintPort.port2.postMessage(0);
      }
    }
    if (this.diagram.unflash(moment)) this.#schedule();
    if (moment - this.panelsAt > PANELS_MS) this.#panels(moment);
    else if (!this.panelsDue) this.panelsDue = setTimeout(() => { this.panelsDue = 0; this.#panels(performance.now()); }, PANELS_MS);
  }

  #panels(moment) {
    this.panelsAt = moment;
    store.tick.value += 1;
    if (moment - (this.wordsAt ?? 0) > WORDS_MS) {
      this.wordsAt = moment;
      store.slowTick.value += 1;
      const newest = store.run.events.at(-1)?.seq ?? 0, left = newest - (this.counted ?? 0);
      this.counted = newest;
      this.diagram.svg.classList.toggle("busy", left > 3 * BUSY * (WORDS_MS / 1000));
    }
    this.mapsDue ||= setTimeout(() => this.#maps(), PANELS_MS / 2); // not all in one long task
    this.#announce(moment);
    this.#follow();
  }

  #maps() {
    this.mapsDue = 0;
    this.timeline.draw();
    this.diagram.paintMinis();
  }

  // What changes without events: clocks, the stale badge, folded containers.
  #beat() {
    const data = store.shown(), now = store.nowMs();
    if (store.cursor.value === null) {
      for (const path of store.activePaths.value) {
        const state = data.states[path];
        if (state?.since != null) this.diagram.tickBadge(path, state, now);
      }
    }
    if (store.heat.value !== "none") this.#heat();
    this.#panels(performance.now());
  }

  #announce(moment) {
    if (moment - this.announcedAt < ANNOUNCE_MS) return;
    const words = `${store.runStatus.value.word}: ${store.activeLeaves.value.slice(0, 6).map((p) => store.model.value?.get(p)?.name ?? shorten(p.split("/").at(-1))).join(", ")}`;
    const region = document.getElementById("spoken");
    if (region && region.textContent !== words) { region.textContent = words; this.announcedAt = moment; }
  }

  #goalOf(data) {
    const found = new Map();
    for (const goal of Object.values(data.goals)) if (goal.ended == null) found.set(goal.path, goal);
    return found;
  }

  #paint(path, data, now) {
    if (!this.diagram.nodes.has(path)) return;
    let goal = null;
    for (const one of Object.values(data.goals)) if (one.path === path && one.ended == null) goal = one;
    this.diagram.paint(path, data.states[path], now, goal, store.unserved(goal));
  }

  paintAll() {
    const data = store.shown(), now = store.nowMs(), goals = this.#goalOf(data);
    for (const path of this.diagram.boxes.keys()) this.diagram.paint(path, data.states[path], now, goals.get(path), store.unserved(goals.get(path)));
    const stops = store.facts.value?.control?.breakpoints ?? [];
    for (const [name, after] of [["stopped", false], ["stopped-after", true]])
      this.diagram.mark(stops.filter(([, outcome]) => (outcome !== null) === after).map(([path]) => path), name);
    this.diagram.mark(store.selected.value ? [store.selected.value] : [], "selected");
    this.#heat();
  }

  #heat() {
    const [weigh, tone] = weights(store.heat.value);
    this.diagram.heat(weigh, tone);
  }

  // -- layout -------------------------------------------------------------------------------------

  async relayout({ frame = false, focus = null } = {}) {
    this.wish = { frame: frame || this.wish?.frame, focus: focus ?? this.wish?.focus };
    if (this.drawing) { this.again = true; return this.drawing; }
    this.drawing = this.#layoutLoop();
    return this.drawing;
  }

  async #layoutLoop() {
    try {
      do {
        this.again = false;
        const model = store.model.value;
        const open = new Set(store.opened.value).add(model.root.path);
        const begun = performance.now();
        const result = model.root.children.length ? await this.layout.run(model.root, open) : null;
        this.layoutMs = performance.now() - begun;
        if (!result || model !== store.model.value) continue;
        const anchor = this.#anchor();
        this.diagram.draw(result, model, store.problems.value);
        this.#hold(anchor);
        this.paintAll();
        if (this.wish?.frame === true && this.view.scaleFor(this.diagram.size) < READABLE && store.shallower()) this.again = true;
      } while (this.again);
      const wish = this.wish ?? {};
      this.wish = null;
      if (wish.focus) this.#focus(wish.focus);
      else if (wish.frame === "follow") this.view.frame(follow.framing(this.diagram, this.view), { most: 1.5 });
      else if (wish.frame) this.fit({ fly: false });
      document.documentElement.dataset.drawn = String(Number(document.documentElement.dataset.drawn ?? 0) + 1);
    } catch (error) {
      store.failure.value = `This machine could not be laid out: ${error.message}`;
      throw error;
    } finally { this.drawing = null; }
  }

  // What is in the middle of the view stays where it is when things around it move.
  #anchor() {
    if (!this.diagram.size) return null;
    const x = (this.view.width / 2 - this.view.x) / this.view.k, y = (this.view.height / 2 - this.view.y) / this.view.k;
    const path = this.toggled ?? [...this.diagram.boxes].filter(([, b]) => x >= b.x && x <= b.x + b.w && y >= b.y && y <= b.y + b.h).at(-1)?.[0];
    this.toggled = null;
    const box = path && this.diagram.boxOf(path);
    return box ? { path, x: box.x, y: box.y } : null;
  }
  #hold(anchor) {
    const box = anchor && this.diagram.boxOf(anchor.path);
    if (box) this.view.set(this.view.x - (box.x - anchor.x) * this.view.k, this.view.y - (box.y - anchor.y) * this.view.k, this.view.k);
  }

  #focus(path) {
    const box = this.diagram.boxOf(path);
    if (box) this.view.frame(box, { margin: 110, most: Math.max(1, Math.min(this.view.k, 1.5)) });
  }

  #follow() {
    if (!store.follow.value || store.cursor.value !== null || this.drawing) return;
    const open = follow.wanted(store.nowMs());
    if (open) { store.opened.value = open; this.relayout({ frame: "follow" }); }
  }

  fit({ fly = true } = {}) {
    if (this.diagram.size) this.fitted = this.view.frame(this.diagram.size, { fly, most: 1.5 });
  }

  // -- what the user does -------------------------------------------------------------------------

  select(path) {
    store.selected.value = path;
    this.diagram.mark(path ? [path] : [], "selected");
    this.timeline.draw();
  }

  goTo(path) {
    this.select(path);
    if (store.reveal(path)) this.relayout({ focus: path });
    else this.#focus(path);
  }

  step(dx, dy) {
    const from = this.diagram.boxOf(store.selected.value);
    if (!from) return;
    const centre = (b) => ({ x: b.x + b.w / 2, y: b.y + Math.min(b.h, 30) / 2 });
    const here = centre(from);
    let best = null;
    for (const [path, box] of this.diagram.boxes) {
      if (path === store.selected.value) continue;
      const there = centre(box), along = (there.x - here.x) * dx + (there.y - here.y) * dy;
      const aside = Math.abs((there.x - here.x) * dy) + Math.abs((there.y - here.y) * dx);
      if (along > 4 && (!best || along + 2 * aside < best.far)) best = { path, far: along + 2 * aside };
    }
    if (best) this.select(best.path);
  }

  toggleSelected() {
    const node = store.model.value?.get(store.selected.value);
    if (node?.children.length && node.parent) this.#toggle(node.path);
  }
  #toggle(path) { this.toggled = path; store.toggle(path); this.relayout(); }

  setFollow(on) {
    store.follow.value = on;
    follow.restart();
    if (on) this.#follow();
  }
  setDepth(levels) {
    const model = store.model.value;
    if (!model) return;
    store.follow.value = false;
    store.setOpened(model.toDepth(levels));
    this.relayout({ frame: true });
  }
  setImplicit(on) { store.setImplicit(on); this.layout.clear(); this.relayout(); }
  setHeat(mode) { store.heat.value = mode; this.#heat(); }
  setTheme(name) { store.theme.value = name; store.applyTheme(); this.timeline.restyle(); this.timeline.draw(); }
  markHits(paths) { this.diagram?.mark(paths, "hit"); }

  #pathOf(e) { return e.target.closest("[data-path]")?.dataset.path ?? null; }
  #click(e) { if (!this.view.moved) this.select(this.#pathOf(e)); }
  #open(e) {
    const node = store.model.value?.get(this.#pathOf(e));
    if (node?.children.length && node.parent) this.#toggle(node.path);
  }
  #jump(e) {
    const move = (m) => {
      const box = e.currentTarget ?? this.diagram.minimap;
      const point = new DOMPoint(m.clientX, m.clientY).matrixTransform(this.diagram.minimap.getScreenCTM().inverse());
      this.view.centre(point.x, point.y);
      void box;
    };
    const up = () => { removeEventListener("pointermove", move); removeEventListener("pointerup", up); };
    addEventListener("pointermove", move);
    addEventListener("pointerup", up);
    move(e);
  }
}

function Stage({ page }) {
  const svg = useRef(), mini = useRef(), canvas = useRef();
  useEffect(() => {
    page.attach(svg.current, mini.current, canvas.current);
    page.ready.catch((error) => { store.failure.value = `The viewer could not start: ${error.message}`; });
  }, []);
  return html`
    <main class="stage">
      <svg class="diagram" ref=${svg} role="application" aria-label="state machine" tabindex="0"></svg>
      <${Overlay} page=${page} />
      <svg class="minimap" ref=${mini} aria-hidden="true"></svg>
      <${Legend} />
    </main>
    <footer class="timeline"><canvas ref=${canvas} tabindex="0" role="slider" aria-label="time; arrow keys wind by events"></canvas>
      <${TimeTools} page=${page} /></footer>`;
}

function Overlay({ page }) {
  const status = store.runStatus.value;
  if (store.failure.value) return html`<div class="empty"><p class="error">${store.failure.value}</p></div>`;
  if (!store.model.value) return html`<${Empty} />`;
  if (status.word === "stale")
    return html`<div class="banner waiting">Stale: nobody has spoken for this machine since ${new Date(ms(store.facts.value.stale)).toLocaleTimeString()}. This is what was last heard.</div>`;
  if (store.connection.value === "lost")
    return html`<div class="banner waiting">The viewer\u2019s server does not answer; this is what was last heard. Trying again\u2026</div>`;
  if (store.cursor.value !== null)
    return html`<div class="banner preempted">You see an earlier instant. <button onClick=${() => page.timeline.live()}>Back to ${store.facts.value?.recorded || isFile() ? "the end" : "now"}</button></div>`;
  return html`<${PreemptBanner} page=${page} />`;
}

// A preempt on its way: who asked, and who holds it up.
function PreemptBanner({ page }) {
  store.tick.value;
  const now = store.nowMs(), found = store.run.now.ended == null ? store.run.preemptAt(now) : null;
  if (!found || found.to !== null) return null;
  const name = (path) => store.model.value?.get(path)?.name ?? path;
  const by = askerText(found.rows[0].asked);
  return html`<div class="banner preempted preempt-banner" role="status"><span>Preempt${by ? html` by <b>${by}</b>` : ""}. Held up by </span>${found.holds.slice(0, 3).map((row, i) => html`${i > 0 ? ", " : ""}<button class="link" onClick=${() => page.goTo(row.path)}>${name(row.path)}</button>
    <span class="times"> for ${holdText(row, now)}</span>`)}${found.holds.length > 3 ? ` and ${found.holds.length - 3} more` : ""}</div>`;
}

function TimeTools({ page }) {
  return html`<div class="time-tools">
    <button title="one event back (,)" aria-label="one event back" onClick=${() => store.seekEvent(-1)}>\u2039</button>
    <button title="one event on (.)" aria-label="one event on" onClick=${() => store.seekEvent(1)}>\u203a</button>
    <button title="show the whole run" onClick=${() => { page.timeline.fitAll(); page.timeline.draw(); }}>All</button>
    <button title="back to now (l)" class=${store.cursor.value === null ? "on" : ""} onClick=${() => page.timeline.live()}>${isFile() || store.facts.value?.recorded ? "End" : "Live"}</button>
  </div>`;
}

function App({ page }) {
  const paused = store.facts.value?.control?.paused && store.cursor.value === null;
  return html`<div class=${`app ${paused ? "paused" : ""}`}>
    <${TopBar} page=${page} /><${Tree} page=${page} /><${Stage} page=${page} /><${Inspector} page=${page} />
    <${ActionsPage} />
    <div id="spoken" class="hidden" aria-live="polite"></div><${Notice} /><${Help} /></div>`;
}

store.applyTheme();
const page = new Page();
window.smachpy = { page, store }; // for tests and the curious
store.place.subscribe(() => { if (page.diagram) { page.paintAll(); page.timeline.draw(); } });
store.served.subscribe(() => { if (page.diagram?.size) page.paintAll(); });
store.facts.subscribe(() => { if (page.diagram?.size) page.paintAll(); });
render(html`<${App} page=${page} />`, document.getElementById("app"));
document.querySelector(".boot")?.remove();
