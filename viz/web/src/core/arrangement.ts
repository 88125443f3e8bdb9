// The arrangement of the panels: dock, order and size of each. In the browser's storage and in links it is one word,
// such as "tree|map:312,details|time,plots|208:416": the panels of the left, right and bottom dock from the top down,
// and the widths of the left and right dock [px]. A panel that is not named is hidden.

import type { Box, Point } from "#core/types.ts";
export type PanelName = "tree" | "map" | "details" | "time" | "plots";
export type DockName = "left" | "right" | "bottom";
/** its height [px]; null: as its content needs */
export type Docked = { name: PanelName; size: number | null };
export type Arrangement = Record<DockName, Docked[]> & { widths: { left: number; right: number } };

export const PANELS: PanelName[] = ["tree", "map", "details", "time", "plots"];
export const DOCKS: DockName[] = ["left", "right", "bottom"];
const HEIGHTS = [56, 2000]; // of a panel [px]
const WIDTHS = [120, 1200]; // of a dock [px]

const within = (size: number, [least, most]: number[]) => Math.round(Math.max(least, Math.min(size, most)));

export const usual = (): Arrangement => ({
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

export function wordOf(all: Arrangement) {
  const dock = (name: DockName) =>
    all[name].map((one) => (one.size === null ? one.name : `${one.name}:${one.size}`)).join(",");
  return [...DOCKS.map(dock), `${all.widths.left}:${all.widths.right}`].join("|");
}

/** The arrangement of a word; null if it is invalid. */
export function arrangementOf(word: unknown): Arrangement | null {
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
      (all[dock] as Docked[]).push({ name: panel, size: size ? within(Number(size), HEIGHTS) : null });
    }
  const [, left, right] = /^(\d{1,4}):(\d{1,4})$/.exec(parts[3]) ?? [];
  if (left === undefined) return null;
  return { ...all, widths: { left: within(Number(left), WIDTHS), right: within(Number(right), WIDTHS) } };
}

/** The place of a panel; null if it is hidden. */
export function placeOf(all: Arrangement, name: PanelName) {
  for (const dock of DOCKS) {
    const index = all[dock].findIndex((one) => one.name === name);
    if (index >= 0) return { dock, index };
  }
  return null;
}

/**
 * The arrangement with a panel in another place.
 * @param dock null: hidden
 * @param index before the panel that has this index there now; at the end without it
 */
export function moved(all: Arrangement, name: PanelName, dock: DockName | null, index: number = Infinity) {
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
 * @param size [px]
 */
export function resized(all: Arrangement, name: PanelName, size: number) {
  const next = { ...all };
  for (const dock of DOCKS)
    next[dock] = all[dock].map((one) => (one.name === name ? { name, size: within(size, HEIGHTS) } : one));
  return next;
}

/**
 * The arrangement with another width of a dock.
 * @param width [px]
 */
export const widened = (all: Arrangement, dock: "left" | "right", width: number) => ({
  ...all,
  widths: { ...all.widths, [dock]: within(width, WIDTHS) },
});

/**
 * The place where a panel is dropped: in the dock below the pointer, otherwise in the nearest one.
 * @param docks as they are now
 */
export function dropAt(
  at: Point,
  docks: { dock: DockName; box: Box; panels: Box[] }[],
  page: { w: number; h: number },
): { dock: DockName; index: number } {
  const inside = (box: Box) => at.x >= box.x && at.x <= box.x + box.w && at.y >= box.y && at.y <= box.y + box.h;
  const over = docks.find((one) => inside(one.box));
  const far: [DockName, number][] = [
    ["left", at.x / page.w],
    ["right", 1 - at.x / page.w],
    ["bottom", 1 - at.y / page.h],
  ];
  const dock = over?.dock ?? far.reduce((a, b) => (b[1] < a[1] ? b : a))[0];
  const panels = docks.find((one) => one.dock === dock)?.panels ?? [];
  const index = panels.filter((box) => at.y > box.y + box.h / 2).length;
  return { dock, index };
}
