// The arrangement of the panels: dock, order and size of each. In the browser's storage and in links it is one word,
// such as "tree|map:312,details|time,plots|208:416": the panels of the left, right and bottom dock from the top down,
// and the widths of the left and right dock [px]. A panel that is not named is hidden.

/** @typedef {"tree" | "map" | "details" | "time" | "plots"} PanelName */
/** @typedef {"left" | "right" | "bottom"} DockName */
/** @typedef {{ name: PanelName, size: number | null }} Docked its height [px]; null: as its content needs */
/** @typedef {Record<DockName, Docked[]> & { widths: { left: number, right: number } }} Arrangement */

/** @type {PanelName[]} */
export const PANELS = ["tree", "map", "details", "time", "plots"];
/** @type {DockName[]} */
export const DOCKS = ["left", "right", "bottom"];
const HEIGHTS = [56, 2000]; // of a panel [px]
const WIDTHS = [120, 1200]; // of a dock [px]

/** @param {number} size @param {number[]} limits */
const within = (size, [least, most]) => Math.round(Math.max(least, Math.min(size, most)));

/** @returns {Arrangement} */
export const usual = () => ({
  left: [{ name: "tree", size: null }],
  right: [
    { name: "map", size: 312 },
    { name: "details", size: null },
  ],
  bottom: [
    { name: "time", size: null },
    { name: "plots", size: null },
  ],
  widths: { left: 208, right: 416 },
});

/** @param {Arrangement} all */
export function wordOf(all) {
  const dock = (/** @type {DockName} */ name) =>
    all[name].map((one) => (one.size === null ? one.name : `${one.name}:${one.size}`)).join(",");
  return [...DOCKS.map(dock), `${all.widths.left}:${all.widths.right}`].join("|");
}

/** The arrangement of a word; null if it is invalid. @param {unknown} word @returns {Arrangement | null} */
export function arrangementOf(word) {
  if (typeof word !== "string" || word.length > 200) return null;
  const parts = word.split("|");
  if (parts.length !== 4) return null;
  const all = { ...usual(), left: [], right: [], bottom: [] };
  const seen = new Set();
  for (const [i, dock] of DOCKS.entries())
    for (const text of parts[i].split(",").filter(Boolean)) {
      const [, name, size] = /^([a-z]+)(?::(\d{1,4}))?$/.exec(text) ?? [];
      const panel = PANELS.find((one) => one === name);
      if (!panel || seen.has(panel)) return null;
      seen.add(panel);
      /** @type {Docked[]} */ (all[dock]).push({ name: panel, size: size ? within(Number(size), HEIGHTS) : null });
    }
  const [, left, right] = /^(\d{1,4}):(\d{1,4})$/.exec(parts[3]) ?? [];
  if (left === undefined) return null;
  return { ...all, widths: { left: within(Number(left), WIDTHS), right: within(Number(right), WIDTHS) } };
}

/** The place of a panel; null if it is hidden. @param {Arrangement} all @param {PanelName} name */
export function placeOf(all, name) {
  for (const dock of DOCKS) {
    const index = all[dock].findIndex((one) => one.name === name);
    if (index >= 0) return { dock, index };
  }
  return null;
}

/**
 * The arrangement with a panel in another place.
 * @param {Arrangement} all
 * @param {PanelName} name
 * @param {DockName | null} dock null: hidden
 * @param {number} [index] before the panel that has this index there now; at the end without it
 */
export function moved(all, name, dock, index = Infinity) {
  const before = placeOf(all, name);
  const same = before !== null && before.dock === dock;
  const size = before && same ? all[before.dock][before.index].size : null;
  const next = { ...all };
  for (const one of DOCKS) next[one] = all[one].filter((panel) => panel.name !== name);
  if (dock === null) return next;
  const at = same && before.index < index ? index - 1 : index; // the panel itself has left its place
  next[dock] = [...next[dock].slice(0, at), { name, size }, ...next[dock].slice(at)];
  return next;
}

/**
 * The arrangement with another height of a panel.
 * @param {Arrangement} all @param {PanelName} name @param {number} size [px]
 */
export function resized(all, name, size) {
  const next = { ...all };
  for (const dock of DOCKS)
    next[dock] = all[dock].map((one) => (one.name === name ? { name, size: within(size, HEIGHTS) } : one));
  return next;
}

/**
 * The arrangement with another width of a dock.
 * @param {Arrangement} all @param {"left" | "right"} dock @param {number} width [px]
 */
export const widened = (all, dock, width) => ({ ...all, widths: { ...all.widths, [dock]: within(width, WIDTHS) } });

/**
 * The place where a panel is dropped: in the dock below the pointer, otherwise in the nearest one.
 * @param {Point} at
 * @param {{ dock: DockName, box: Box, panels: Box[] }[]} docks as they are now
 * @param {{ w: number, h: number }} page
 * @returns {{ dock: DockName, index: number }}
 */
export function dropAt(at, docks, page) {
  const inside = (/** @type {Box} */ box) =>
    at.x >= box.x && at.x <= box.x + box.w && at.y >= box.y && at.y <= box.y + box.h;
  const over = docks.find((one) => inside(one.box));
  /** @type {[DockName, number][]} */
  const far = [
    ["left", at.x / page.w],
    ["right", 1 - at.x / page.w],
    ["bottom", 1 - at.y / page.h],
  ];
  const dock = over?.dock ?? far.reduce((a, b) => (b[1] < a[1] ? b : a))[0];
  const panels = docks.find((one) => one.dock === dock)?.panels ?? [];
  const index = panels.filter((box) => at.y > box.y + box.h / 2).length;
  return { dock, index };
}
