// Follow mode: what runs is open, the rest folds, and the view frames what can still be read.
import * as store from "viewer/store";
import { ms } from "viewer/fold";

const SETTLED = 450; // a container opens when it has run for so long [ms]
const CALM = 900; // between two rearrangements [ms]
const READABLE = 0.82; // the scale at which the smallest text has 9 px
let last = "";
let at = 0;

// The containers that should be open, or null when nothing is to change.
export function wanted(now) {
  const model = store.model.value;
  const moment = performance.now();
  if (!model || moment - at < CALM) return null;
  const states = store.shown().states;
  const open = new Set([model.root.path]);
  for (const path of store.activePaths.value) {
    const node = model.get(path), since = states[path]?.since;
    if (node?.children.length && since != null && now - ms(since) > SETTLED) open.add(path);
  }
  const key = [...open].sort().join("\n");
  if (key === last) return null;
  last = key;
  at = moment;
  return open;
}

export function restart() { last = ""; at = 0; }

// The largest box on the active path whose text is legible when it fills the view.
export function framing(diagram, view) {
  const leaves = store.activeLeaves.value;
  const model = store.model.value;
  if (!leaves.length || !model) return diagram.size;
  const deepest = leaves.reduce((a, b) => (b.split("/").length > a.split("/").length ? b : a));
  const shared = model.ancestors(deepest).filter((n) => leaves.every((l) => l.startsWith(n.path + "/")));
  const boxes = shared.map((n) => diagram.boxOf(n.path)).filter(Boolean);
  const own = model.ancestors(deepest).map((n) => diagram.boxOf(n.path)).filter(Boolean);
  const legible = (some) => some.find((box) => view.scaleFor(box) >= READABLE);
  return atLeast(legible(boxes) ?? legible(own) ?? own.at(-1) ?? diagram.size, view);
}

// Something small is shown with what is around it, not blown up.
function atLeast(box, view) {
  const w = Math.max(box.w, view.width * 0.9), h = Math.max(box.h, view.height * 0.9);
  return { x: box.x - (w - box.w) / 2, y: box.y - (h - box.h) / 2, w, h };
}
