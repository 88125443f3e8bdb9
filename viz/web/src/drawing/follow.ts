// Follow mode: opens the running containers, closes the others, and frames the running states as far as they are
// legible.

import { store } from "#core/store.ts";
import type { Box } from "#core/types.ts";
import type { Diagram } from "#drawing/diagram.ts";
import type { Viewport } from "#drawing/viewport.ts";

const SETTLED_MS = 450; // a container is opened after running for this time: brief ones would only flicker
const PAUSE_MS = 900; // shortest time between two rearrangements
const READABLE = 0.84; // a little above the scale at which names have 9 px

export class Follow {
  #lastOpen = "";
  #rearrangedAt = -Infinity; // [ms]

  /** Paths of the containers that should be open; null if nothing is to change. @param now [ms] */
  containersToOpen(now: number) {
    const model = store.data.model.value;
    const moment = performance.now();
    if (!model || moment - this.#rearrangedAt < PAUSE_MS) return null;
    const states = store.playback.shown().states;
    const open = new Set([model.root.path]);
    const active = store.status.activePaths.value;
    const ended = active.length === 0; // then the containers in which it ended are open
    for (const path of ended ? store.status.lastLeaves.value.flatMap(around) : active) {
      const since = ended ? 0 : states[path]?.since;
      const node = model.get(path);
      if (node?.children.length && !model.isBranch(node) && since != null && now - since / 1e6 > SETTLED_MS)
        open.add(path);
    }
    const key = [...open].sort().join("\n");
    if (key === this.#lastOpen) return null;
    this.#lastOpen = key;
    this.#rearrangedAt = moment;
    return open;
  }

  /** Forget the open containers, so that the next call answers at once. */
  restart() {
    this.#lastOpen = "";
    this.#rearrangedAt = -Infinity;
  }
}

/** The containers around a state. */
const around = (path: string) => store.data.model.value?.ancestors(path).map((node) => node.path) ?? [];

/** The box around all running states; a state in a closed container counts as that container. */
function boxOfActive(boxes: Map<string, Box>): Box | null {
  const found = store.status.lastLeaves.value.flatMap((path) => {
    let at = path;
    while (at && !boxes.has(at)) at = at.slice(0, Math.max(0, at.lastIndexOf("/")));
    return boxes.get(at) ?? [];
  });
  if (!found.length) return null;
  const x = Math.min(...found.map((box) => box.x));
  const y = Math.min(...found.map((box) => box.y));
  const right = Math.max(...found.map((box) => box.x + box.w));
  const bottom = Math.max(...found.map((box) => box.y + box.h));
  return { x, y, w: right - x, h: bottom - y };
}

/** Whether all running states are legible at once. */
export function isLegible(boxes: Map<string, Box>, view: Viewport) {
  const box = boxOfActive(boxes);
  return !box || view.scaleFor(box) >= READABLE;
}

/** These containers without the deepest ones; null if only the root is left. */
export function oneLevelLess(open: Set<string>) {
  const depth = (path: string) => path.split("/").length;
  const deepest = Math.max(...[...open].map(depth));
  const less = [...open].filter((path) => depth(path) < deepest);
  return less.length ? new Set(less) : null;
}

/**
 * The largest box around all running states that is legible when it fills the view.
 * @param whole the whole diagram
 */
export function boxToFrame(diagram: Diagram, view: Viewport, whole: Box) {
  const leaves = store.status.lastLeaves.value;
  const model = store.data.model.value;
  const active = boxOfActive(diagram.picture.boxes);
  if (!active || !model) return whole;
  const shared = model.ancestors(leaves[0]).filter((node) => leaves.every((leaf) => leaf.startsWith(`${node.path}/`)));
  for (const { path } of shared) {
    const box = diagram.boxOf(path);
    if (box && view.scaleFor(box) >= READABLE) return atLeast(box, view);
  }
  if (view.scaleFor(active) >= READABLE) return atLeast(active, view);
  // Not all are legible at once, even with everything closed: the state that began last is in the middle.
  const states = store.playback.shown().states;
  const newest = leaves.reduce((a, b) => ((states[b]?.since ?? 0) > (states[a]?.since ?? 0) ? b : a));
  const at = boxOfOne(diagram, newest) ?? active;
  const [w, h] = [view.width / READABLE, view.height / READABLE];
  return { x: at.x + at.w / 2 - w / 2, y: at.y + at.h / 2 - h / 2, w, h };
}

function boxOfOne(diagram: Diagram, path: string) {
  for (let at = path; at; at = at.slice(0, Math.max(0, at.lastIndexOf("/")))) {
    const box = diagram.boxOf(at);
    if (box) return box;
  }
  return null;
}

/** The box, made at least as large as the view: small states are not enlarged. */
function atLeast(box: Box, view: Viewport) {
  const w = Math.max(box.w, view.width * 0.9);
  const h = Math.max(box.h, view.height * 0.9);
  return { x: box.x - (w - box.w) / 2, y: box.y - (h - box.h) / 2, w, h };
}
