// The panels around the diagram, in docks: they can be moved, resized and hidden.
import { signal } from "@preact/signals";
import { DOCKS, dropAt, moved, placeOf, resized, widened } from "#core/arrangement.js";
import * as store from "#core/store.js";
import { drag } from "#drawing/viewport.js";
import { fieldValue, html } from "#panels/html.js";

/** @typedef {import("#core/arrangement.js").PanelName} PanelName */
/** @typedef {import("#core/arrangement.js").DockName} DockName */

const STEP = 24; // of an arrow key [px]
/** @type {Record<PanelName, string>} */
const TITLES = { tree: "States", map: "Map", details: "Details", time: "Timeline", plots: "Plots" };
/** @type {Record<string, DockName | null>} */
const KEYS = { ArrowLeft: "left", ArrowRight: "right", ArrowDown: "bottom", Delete: null };

/** @type {import("@preact/signals").Signal<{ dock: DockName, index: number } | null>} */
const dropped = signal(null); // place at which the dragged panel would be dropped

/** @param {{ name: DockName, panels: Record<PanelName, () => any> }} props what draws each panel */
export function Dock({ name, panels }) {
  const all = store.arrangementShown.value;
  const docked = all[name].filter((one) => store.panelsThere.value.has(one.name));
  const at = dropped.value?.dock === name ? dropped.value.index : null;
  const width = name === "bottom" ? {} : { "--width": `${all.widths[name]}px` };
  const isEmpty = !docked.length && at === null;
  return html`<div class=${`dock ${name} ${isEmpty ? "empty-dock" : ""} ${at === null ? "" : "target"}`} style=${width}>
    ${name !== "bottom" && docked.length > 0 && html`<${WidthHandle} dock=${name} />`}
    ${docked.map(({ name: panel, size }, i) => {
      const classes = ["panel", `panel-${panel}`, size !== null && "sized", at === i && "before"];
      const isSizable = name === "bottom" || i < docked.length - 1;
      return html`<div key=${panel} data-panel=${panel} class=${classes.filter(Boolean).join(" ")}
          style=${size === null ? {} : { "--size": `${size}px` }}>
        ${panels[panel]()}
        <${Grip} name=${panel} />
        ${isSizable && html`<${HeightHandle} dock=${name} name=${panel} />`}</div>`;
    })}</div>`;
}

/** The handle that moves a panel, by dragging or arrow keys. @param {{ name: PanelName }} props */
function Grip({ name }) {
  const put = (/** @type {DockName | null} */ dock, /** @type {number} */ index = Infinity) =>
    store.arrange(moved(store.arrangementShown.value, name, dock, index));
  const onPointerDown = (/** @type {PointerEvent} */ e) => {
    if (e.button !== 0) return;
    e.preventDefault();
    const move = (/** @type {PointerEvent} */ m) => {
      const page = { w: innerWidth, h: innerHeight };
      dropped.value = dropAt({ x: m.clientX, y: m.clientY }, boxesOfDocks(), page);
    };
    drag(move, (m) => {
      const place = dropped.value;
      dropped.value = null;
      if (!place || m.type === "pointercancel") return;
      const behind = docked(place.dock)[place.index];
      const index = behind ? placeOf(store.arrangementShown.value, behind)?.index : undefined;
      put(place.dock, index);
    });
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ e) => {
    const all = store.arrangementShown.value;
    const place = placeOf(all, name);
    if (e.key === "ArrowUp" && place) put(place.dock, Math.max(0, place.index - 1));
    else if (e.key === "ArrowDown" && place && place.index < all[place.dock].length - 1)
      put(place.dock, place.index + 2);
    else if (e.key in KEYS) put(KEYS[e.key]);
    else return;
    e.preventDefault();
    e.stopPropagation();
    // In another dock the panel is a new element: focus its handle again.
    requestAnimationFrame(() => gripOf(name)?.focus());
  };
  const title = `${TITLES[name]}: drag it to another side; arrow keys move it, Delete hides it, View shows it again`;
  return html`<button class="grip" aria-label=${title} title=${title} onPointerDown=${onPointerDown}
    onKeyDown=${onKeyDown}>\u22ee</button>`;
}

/** @param {PanelName} name @returns {HTMLElement | null} */
const gripOf = (name) => document.querySelector(`[data-panel=${name}] > .grip`);

/** Names of the visible panels in a dock. @param {DockName} name */
const docked = (name) =>
  store.arrangementShown.value[name].map((one) => one.name).filter((one) => store.panelsThere.value.has(one));

function boxesOfDocks() {
  const boxOf = (/** @type {Element} */ element) => {
    const { x, y, width: w, height: h } = element.getBoundingClientRect();
    return { x, y, w, h };
  };
  return DOCKS.flatMap((dock) => {
    const element = document.querySelector(`.dock.${dock}`);
    if (!element) return [];
    return [{ dock, box: boxOf(element), panels: [...element.querySelectorAll(":scope > .panel")].map(boxOf) }];
  });
}

/**
 * A border that can be moved, by dragging or arrow keys.
 * @param {{ label: string, vertical: boolean, size: () => number, resize: (size: number) => void, sign: 1 | -1 }} props
 */
function Handle({ label, vertical, size, resize, sign }) {
  const onPointerDown = (/** @type {PointerEvent} */ e) => {
    if (e.button !== 0) return;
    e.preventDefault();
    const before = size();
    drag((m) => resize(before + sign * (vertical ? m.clientX - e.clientX : m.clientY - e.clientY)));
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ e) => {
    const [less, more] = vertical ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    const step = { [less]: -1, [more]: 1 }[e.key];
    if (!step) return;
    resize(size() + sign * step * STEP);
    e.preventDefault();
    e.stopPropagation();
  };
  return html`<div class=${`handle ${vertical ? "upright" : "level"}`} role="separator" tabindex="0"
    aria-label=${label} aria-orientation=${vertical ? "vertical" : "horizontal"}
    onPointerDown=${onPointerDown} onKeyDown=${onKeyDown}></div>`;
}

/** @param {{ dock: "left" | "right" }} props */
const WidthHandle = ({ dock }) =>
  html`<${Handle} label=${`width of the ${dock} side`} vertical=${true} sign=${dock === "left" ? 1 : -1}
    size=${() => store.arrangementShown.value.widths[dock]}
    resize=${(/** @type {number} */ width) => store.arrange(widened(store.arrangementShown.value, dock, width))} />`;

/** @param {{ dock: DockName, name: PanelName }} props */
const HeightHandle = ({ dock, name }) =>
  html`<${Handle} label=${`height of ${TITLES[name]}`} vertical=${false} sign=${dock === "bottom" ? -1 : 1}
    size=${() => document.querySelector(`[data-panel=${name}]`)?.clientHeight ?? 0}
    resize=${(/** @type {number} */ size) => store.arrange(resized(store.arrangementShown.value, name, size))} />`;

/** The choice of a dock for each panel. */
export function PanelLines() {
  const all = store.arrangementShown.value;
  const choose = (/** @type {PanelName} */ name) => (/** @type {Event} */ e) => {
    const dock = DOCKS.find((one) => one === fieldValue(e)) ?? null;
    store.arrange(moved(all, name, dock));
  };
  const select = (/** @type {[string, string]} */ [name, title]) => {
    const panel = /** @type {PanelName} */ (name);
    return html`<label class="line"><span>${title}</span>
      <select value=${placeOf(all, panel)?.dock ?? "hidden"} onChange=${choose(panel)}>
        ${[...DOCKS, "hidden"].map((one) => html`<option value=${one}>${one}</option>`)}</select></label>`;
  };
  return html`<details class="panel-lines"><summary>Panels</summary>${Object.entries(TITLES).map(select)}
    <div class="line"><span>As they were</span>
      <button onClick=${() => store.arrange(null)}>reset</button></div></details>`;
}

/** The choice of the part that is shown on a phone. */
export function Parts() {
  const part = (/** @type {[string, string, string]} */ [name, title, path]) => {
    const isShown = store.part.value === name;
    const onClick = () => {
      store.part.value = name;
    };
    return html`<button class=${isShown ? "on" : ""} aria-current=${isShown ? "page" : undefined} onClick=${onClick}>
      <svg viewBox="0 0 24 24" aria-hidden="true"><path d=${path} /></svg>${title}</button>`;
  };
  return html`<nav class="parts" aria-label="parts of the page">${PARTS.filter(
    ([name]) => name !== "map" || store.hasMap.value,
  ).map(part)}</nav>`;
}

/** @type {[string, string, string][]} */
const PARTS = [
  ["machine", "Machine", "M3 4h7v6H3ZM14 14h7v6h-7ZM10 7h7v7"],
  ["map", "Map", "M3 6l6-2 6 2 6-2v14l-6 2-6-2-6 2ZM9 4v14M15 6v14"],
  ["time", "Time", "M12 3a9 9 0 1 0 .01 0ZM12 7v5l3 2"],
  ["log", "Log", "M8 6h13M8 12h13M8 18h13M3 6h1M3 12h1M3 18h1"],
];
