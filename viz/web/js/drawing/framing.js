// Follow mode: what runs is open, the rest folds, and the view frames what can still be read.
import * as store from "#core/store.js";

/** @typedef {import("#drawing/diagram.js").Diagram} Diagram */
/** @typedef {import("#drawing/viewport.js").Viewport} Viewport */

const SETTLED_MS = 450; // a container opens when it has run for so long
const PAUSE_MS = 900; // between two rearrangements
const READABLE = 0.82; // the scale at which the smallest text has 9 px
let lastOpen = "";
let rearrangedAt = -Infinity; // [ms]

/** Paths of the containers that should be open, or null when nothing is to change. @param {number} now [ms] */
export function containersToOpen(now) {
  const model = store.model.value;
  const moment = performance.now();
  if (!model || moment - rearrangedAt < PAUSE_MS) return null;
  const states = store.shown().states;
  const open = new Set([model.root.path]);
  for (const path of store.activePaths.value) {
    const since = states[path]?.since;
    if (model.get(path)?.children.length && since != null && now - since / 1e6 > SETTLED_MS) open.add(path);
  }
  const key = [...open].sort().join("\n");
  if (key === lastOpen) return null;
  lastOpen = key;
  rearrangedAt = moment;
  return open;
}

/** Forget what was open, so that the next answer is given at once. */
export function restart() {
  lastOpen = "";
  rearrangedAt = -Infinity;
}

/**
 * The largest box around what runs whose text is legible when it fills the view.
 * @param {Diagram} diagram
 * @param {Viewport} view
 * @param {Box} whole the whole diagram
 */
export function boxToFrame(diagram, view, whole) {
  const leaves = store.activeLeaves.value;
  const model = store.model.value;
  if (!leaves.length || !model) return whole;
  const deepest = leaves.reduce((a, b) => (b.split("/").length > a.split("/").length ? b : a));
  const around = model.ancestors(deepest);
  const shared = around.filter((node) => leaves.every((leaf) => leaf.startsWith(`${node.path}/`)));
  /** @type {(nodes: StateNode[]) => Box[]} */
  const boxesOf = (nodes) => nodes.map((node) => diagram.boxOf(node.path)).filter((box) => box !== undefined);
  /** @type {(boxes: Box[]) => Box | undefined} */
  const legible = (boxes) => boxes.find((box) => view.scaleFor(box) >= READABLE);
  const deep = boxesOf(around);
  return atLeast(legible(boxesOf(shared)) ?? legible(deep) ?? deep.at(-1) ?? whole, view);
}

/** Something small is shown with what is around it, not enlarged. @param {Box} box @param {Viewport} view */
function atLeast(box, view) {
  const w = Math.max(box.w, view.width * 0.9);
  const h = Math.max(box.h, view.height * 0.9);
  return { x: box.x - (w - box.w) / 2, y: box.y - (h - box.h) / 2, w, h };
}
