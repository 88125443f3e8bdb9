// The panels around the diagram, in docks: they can be moved, resized and hidden.

import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useState } from "preact/hooks";
import type { DockName, PanelName } from "#core/arrangement.ts";
import { DOCKS, dropAt, moved, placeOf, resized, widened } from "#core/arrangement.ts";
import { store } from "#core/store.ts";
import { drag } from "#drawing/viewport.ts";
import { fieldValue } from "#panels/components.tsx";

const STEP = 24; // of an arrow key [px]
const TITLES: Record<PanelName, string> = {
  tree: "States",
  map: "Map",
  details: "Details",
  time: "Timeline",
  plots: "Plots",
};
const KEYS: Record<string, DockName | null> = {
  ArrowLeft: "left",
  ArrowRight: "right",
  ArrowDown: "bottom",
  Delete: null,
};

/** Place at which the dragged panel would be dropped. */
const dropped: Signal<{ dock: DockName; index: number } | null> = signal(null);

/** @param props what draws each panel */
export function Dock({ name, panels }: { name: DockName; panels: Record<PanelName, () => ComponentChildren> }) {
  const all = store.panels.arrangementShown.value;
  const docked = all[name].filter((one) => store.panels.panelsThere.value.has(one.name));
  const at = dropped.value?.dock === name ? dropped.value.index : null;
  const width = name === "bottom" ? {} : { "--width": `${all.widths[name]}px` };
  const isEmpty = !docked.length && at === null;
  return (
    <div class={`dock ${name} ${isEmpty ? "empty-dock" : ""} ${at === null ? "" : "target"}`} style={width}>
      {name !== "bottom" && docked.length > 0 && <WidthHandle dock={name} />}
      {docked.map(({ name: panel, size }, i) => {
        const classes = ["panel", `panel-${panel}`, size !== null && "sized", at === i && "before"];
        const isSizable = name === "bottom" || i < docked.length - 1;
        return (
          <div
            key={panel}
            data-panel={panel}
            class={classes.filter(Boolean).join(" ")}
            style={size === null ? {} : { "--size": `${size}px` }}
          >
            {panels[panel]()}
            <Grip name={panel} />
            {isSizable && <HeightHandle dock={name} name={panel} />}
          </div>
        );
      })}
    </div>
  );
}

/** The handle that moves a panel, by dragging or arrow keys. */
function Grip({ name }: { name: PanelName }) {
  const put = (dock: DockName | null, index: number = Infinity) =>
    store.panels.arrange(moved(store.panels.arrangementShown.value, name, dock, index));
  const onPointerDown = (e: PointerEvent) => {
    if (e.button !== 0) return;
    e.preventDefault();
    const move = (m: PointerEvent) => {
      const page = { w: innerWidth, h: innerHeight };
      dropped.value = dropAt({ x: m.clientX, y: m.clientY }, boxesOfDocks(), page);
    };
    drag(move, (m) => {
      const place = dropped.value;
      dropped.value = null;
      if (!place || m.type === "pointercancel") return;
      const behind = docked(place.dock)[place.index];
      const index = behind ? placeOf(store.panels.arrangementShown.value, behind)?.index : undefined;
      put(place.dock, index);
    });
  };
  const onKeyDown = (e: KeyboardEvent) => {
    const all = store.panels.arrangementShown.value;
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
  return (
    <button class="grip" aria-label={title} title={title} onPointerDown={onPointerDown} onKeyDown={onKeyDown}>
      ⋮
    </button>
  );
}

const gripOf = (name: PanelName): HTMLElement | null => document.querySelector(`[data-panel=${name}] > .grip`);

/** Names of the visible panels in a dock. */
const docked = (name: DockName) =>
  store.panels.arrangementShown.value[name]
    .map((one) => one.name)
    .filter((one) => store.panels.panelsThere.value.has(one));

function boxesOfDocks() {
  const boxOf = (element: Element) => {
    const { x, y, width: w, height: h } = element.getBoundingClientRect();
    return { x, y, w, h };
  };
  return DOCKS.flatMap((dock) => {
    const element = document.querySelector(`.dock.${dock}`);
    if (!element) return [];
    return [{ dock, box: boxOf(element), panels: [...element.querySelectorAll(":scope > .panel")].map(boxOf) }];
  });
}

/** A border that can be moved, by dragging or arrow keys. */
function Handle({
  label,
  vertical,
  size,
  resize,
  sign,
}: {
  label: string;
  vertical: boolean;
  size: () => number;
  resize: (size: number) => void;
  sign: 1 | -1;
}) {
  const [shown, setShown] = useState(0);
  useEffect(() => setShown(size()));

  const onPointerDown = (e: PointerEvent) => {
    if (e.button !== 0) return;
    e.preventDefault();
    const before = size();
    drag((m) => resize(before + sign * (vertical ? m.clientX - e.clientX : m.clientY - e.clientY)));
  };
  const onKeyDown = (e: KeyboardEvent) => {
    const [less, more] = vertical ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    const step = { [less]: -1, [more]: 1 }[e.key];
    if (!step) return;
    resize(size() + sign * step * STEP);
    e.preventDefault();
    e.stopPropagation();
  };
  return (
    <div
      class={`handle ${vertical ? "upright" : "level"}`}
      role="separator"
      tabindex={0}
      aria-label={label}
      aria-orientation={vertical ? "vertical" : "horizontal"}
      aria-valuenow={Math.round(shown)}
      aria-valuemin={56}
      aria-valuemax={2000}
      aria-valuetext={`${Math.round(shown)} pixels`}
      onPointerDown={onPointerDown}
      onKeyDown={onKeyDown}
    />
  );
}

const WidthHandle = ({ dock }: { dock: "left" | "right" }) => (
  <Handle
    label={`width of the ${dock} side`}
    vertical={true}
    sign={dock === "left" ? 1 : -1}
    size={() => store.panels.arrangementShown.value.widths[dock]}
    resize={(width: number) => store.panels.arrange(widened(store.panels.arrangementShown.value, dock, width))}
  />
);

const HeightHandle = ({ dock, name }: { dock: DockName; name: PanelName }) => (
  <Handle
    label={`height of ${TITLES[name]}`}
    vertical={false}
    sign={dock === "bottom" ? -1 : 1}
    size={() => document.querySelector(`[data-panel=${name}]`)?.clientHeight ?? 0}
    resize={(size: number) => store.panels.arrange(resized(store.panels.arrangementShown.value, name, size))}
  />
);

/** The choice of a dock for each panel. */
export function PanelLines() {
  const all = store.panels.arrangementShown.value;
  const choose = (name: PanelName) => (e: Event) => {
    const dock = DOCKS.find((one) => one === fieldValue(e)) ?? null;
    store.panels.arrange(moved(all, name, dock));
  };
  const select = ([name, title]: [string, string]) => {
    const panel = name as PanelName;
    return (
      <label class="line">
        <span>{title}</span>
        <select value={placeOf(all, panel)?.dock ?? "hidden"} onChange={choose(panel)}>
          {[...DOCKS, "hidden"].map((one) => (
            <option value={one}>{one}</option>
          ))}
        </select>
      </label>
    );
  };
  return (
    <details class="panel-lines">
      <summary>Panels</summary>
      {Object.entries(TITLES).map(select)}
      <div class="line">
        <span>As they were</span>
        <button onClick={() => store.panels.arrange(null)}>reset</button>
      </div>
    </details>
  );
}

/** The choice of the part that is shown on a phone. */
export function Parts() {
  const part = ([name, title, path]: [string, string, string]) => {
    const isShown = store.view.part.value === name;
    const onClick = () => {
      store.view.part.value = name;
    };
    return (
      <button class={isShown ? "on" : ""} aria-current={isShown ? "page" : undefined} onClick={onClick}>
        <svg viewBox="0 0 24 24" aria-hidden="true">
          <path d={path} />
        </svg>
        {title}
      </button>
    );
  };
  return (
    <nav class="parts" aria-label="parts of the page">
      {PARTS.filter(([name]) => name !== "map" || store.panels.hasMap.value).map(part)}
    </nav>
  );
}

const PARTS: [string, string, string][] = [
  ["machine", "Machine", "M3 4h7v6H3ZM14 14h7v6h-7ZM10 7h7v7"],
  ["map", "Map", "M3 6l6-2 6 2 6-2v14l-6 2-6-2-6 2ZM9 4v14M15 6v14"],
  ["time", "Time", "M12 3a9 9 0 1 0 .01 0ZM12 7v5l3 2"],
  ["log", "Log", "M8 6h13M8 12h13M8 18h13M3 6h1M3 12h1M3 18h1"],
];
