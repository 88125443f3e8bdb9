// Puts the page together. The diagram, timeline and map draw themselves outside the virtual DOM; the panels are Preact
// components.
import "@preact/signals";
import { render } from "preact";
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { DOCKS } from "#core/arrangement.js";
import { messageOf } from "#core/connection.js";
import * as store from "#core/store.js";
import { Page } from "#drawing/page.js";
import { el } from "#drawing/svg.js";
import { applyTheme } from "#drawing/theme.js";
import { ActionsPage } from "#panels/actions.js";
import { Dock, Parts } from "#panels/docks.js";
import { FleetPage } from "#panels/fleet.js";
import { HomePage } from "#panels/home.js";
import { html } from "#panels/html.js";
import { Inspector } from "#panels/inspector.js";
import { listenToKeys } from "#panels/keys.js";
import { MapPanel } from "#panels/map.js";
import { Help, Laying, Legend, Notice, Overlay, TokenDialog } from "#panels/messages.js";
import { NoteDialog, ShareButtons } from "#panels/notes.js";
import { PlayBar } from "#panels/play.js";
import { AddLine, PlotsPanel } from "#panels/plots.js";
import { SimulateDialog } from "#panels/simulate.js";
import { TopBar } from "#panels/top_bar.js";
import { Tree } from "#panels/tree.js";

const svg = el("svg", { class: "diagram", role: "application", "aria-label": "state machine", tabindex: 0 });
const minimap = el("svg", { class: "minimap", "aria-hidden": "true" });
const canvas = document.createElement("canvas");
canvas.tabIndex = 0;
canvas.setAttribute("role", "slider");
canvas.setAttribute("aria-label", "time; arrow keys go from event to event");

const floor = document.createElement("canvas");
floor.tabIndex = 0;
floor.setAttribute("role", "img");

/** Holds an element from outside the virtual DOM. @param {{ element: Element }} props */
function Mounted({ element }) {
  const place = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => place.current?.replaceChildren(element), [element]);
  return html`<div class="mounted" ref=${place}></div>`;
}

function TimeTools() {
  const { timeline } = page;
  const showAll = () => {
    timeline.fitAll();
    timeline.draw();
  };
  const addPlot = (/** @type {string} */ id) => store.setPlots([...store.plotsShown.value, [id]]);
  return html`<div class="time-tools"><button title="show the whole run" onClick=${showAll}>All</button>
    <${AddLine} label="plot a number of the run" text="Plot" onPick=${addPlot} /></div>`;
}

function ZoomButtons() {
  return html`<span class="zoom">
    <button title="smaller (-)" aria-label="zoom out" onClick=${() => page.view.zoom(0.8)}>\u2212</button>
    <button title="larger (+)" aria-label="zoom in" onClick=${() => page.view.zoom(1.25)}>+</button>
    <button title="show everything (0)" onClick=${() => page.refit()}>Fit</button></span>`;
}

/** @type {Record<import("#core/arrangement.js").PanelName, () => any>} */
const panels = {
  tree: () => html`<${Tree} page=${page} />`,
  map: () => html`<${MapPanel} page=${page}><${Mounted} element=${floor} /><//>`,
  details: () => html`<${Inspector} page=${page} />`,
  time: () => html`<div class="timeline"><${Mounted} element=${canvas} /><${TimeTools} /></div>`,
  plots: () => html`<${PlotsPanel} page=${page} />`,
};

function App() {
  const paused = store.facts.value?.control?.paused && store.cursor.value === null;
  useEffect(() => {
    page.start().catch((error) => {
      store.failure.value = `The viewer could not start: ${messageOf(error)}`;
    });
  }, []);
  const classes = [
    "app",
    paused && "paused",
    store.cursor.value !== null && "past",
    store.treeOpen.value && "with-tree",
    store.asksNow.value && "asks",
    `part-${store.part.value}`,
  ];
  return html`<div class=${classes.filter(Boolean).join(" ")}>
    <${TopBar} page=${page} />
    ${DOCKS.map((name) => html`<${Dock} key=${name} name=${name} panels=${panels} />`)}
    <main class="stage">
      <${Mounted} element=${svg} />
      <${Overlay} page=${page} />
      <${Laying} />
      <${Mounted} element=${minimap} />
      <div class="strip"><${Legend} /><${ShareButtons} page=${page} /><${ZoomButtons} /></div>
    </main>
    <${PlayBar} page=${page} />
    <${Parts} />
    <${HomePage} />
    <${FleetPage} />
    <${ActionsPage} />
    <div id="announced" class="hidden" aria-live="polite"></div>
    <${Notice} />
    <${Help} />
    <${TokenDialog} />
    <${NoteDialog} />
    <${SimulateDialog} />
  </div>`;
}

applyTheme();
const page = new Page(/** @type {SVGSVGElement} */ (svg), /** @type {SVGSVGElement} */ (minimap), canvas, floor);
listenToKeys(page);
window.smachpy = { page, store }; // for tests, and for looking around in the browser's console
render(html`<${App} />`, /** @type {HTMLElement} */ (document.getElementById("app")));
document.querySelector(".boot")?.remove();
