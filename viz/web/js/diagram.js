// The picture: built once per layout, restyled by class when something happens.
import { CONTAINERS, KIND_NAMES, SIGNS, classOfAll, outcomeClass, signed } from "viewer/model";
import { measure } from "viewer/measure";
import { ms } from "viewer/fold";

const NS = "http://www.w3.org/2000/svg";
const SEP = "\u0001";
const FLASH_MS = 380, FADE_MS = 5000;
const BRIEF_MS = 400; // a state that has run for less has no clock
const ICONS = { // in a box of 10 x 10
  action: "M2 1.2 8.6 5 2 8.8Z", service: "M1 3.4h7M6 1.2 8.4 3.4 6 5.6M9 6.8H2M4 4.6 1.6 6.8 4 9",
  monitor: "M5 1a4 4 0 1 0 0 8a4 4 0 1 0 0-8M5 3.4a1.6 1.6 0 1 0 0 3.2a1.6 1.6 0 1 0 0-3.2",
  condition: "M5 .8 9.2 5 5 9.2 .8 5Z", callback: "M4 5a1 1 0 1 0 2 0a1 1 0 1 0-2 0",
  state: "M4 5a1 1 0 1 0 2 0a1 1 0 1 0-2 0", machine: "M1 1.5h8v7H1ZM1 4h8",
  sequence: "M1 5h7M6 2.6 8.6 5 6 7.4", concurrence: "M3 1v8M7 1v8",
  iterator: "M8.4 5a3.4 3.4 0 1 1-1.2-2.6M8.6 .8v2.4H6.2", missing: "M2 2l6 6M8 2 2 8",
};
const STROKED = new Set(["service", "machine", "sequence", "concurrence", "iterator", "missing", "condition"]);
const TAGS = { concurrence: "concurrent", iterator: "repeats", sequence: "sequence" };

export function el(name, attributes = {}, ...children) {
  const made = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes))
    if (value != null) made.setAttribute(key, value);
  made.append(...children);
  return made;
}
export const icon = (kind, x, y, className = "icon") =>
  el("path", { d: ICONS[kind] ?? ICONS.state, transform: `translate(${x} ${y})`,
    class: `${className} ${STROKED.has(kind) ? "stroked" : ""}` });

function rounded(points, radius = 6) {
  const at = (p) => `${p.x.toFixed(1)} ${p.y.toFixed(1)}`;
  let d = `M${at(points[0])}`;
  for (let i = 1; i < points.length - 1; i++) {
    const [a, b, c] = [points[i - 1], points[i], points[i + 1]];
    const before = Math.hypot(b.x - a.x, b.y - a.y), after = Math.hypot(c.x - b.x, c.y - b.y);
    const r = Math.min(radius, before / 2, after / 2);
    if (r < 0.5) { d += `L${at(b)}`; continue; }
    const from = { x: b.x + ((a.x - b.x) / before) * r, y: b.y + ((a.y - b.y) / before) * r };
    const to = { x: b.x + ((c.x - b.x) / after) * r, y: b.y + ((c.y - b.y) / after) * r };
    d += `L${at(from)}Q${at(b)} ${at(to)}`;
  }
  return `${d}L${at(points.at(-1))}`;
}

export class Diagram {
  constructor(svg, minimap) {
    this.svg = svg;
    this.minimap = minimap;
    this.world = el("g", { class: "world" });
    svg.replaceChildren(markers(), this.world);
    this.clear();
    this.flashing = new Map();
  }

  clear() {
    this.nodes = new Map();
    this.arrows = new Map();
    this.boxes = new Map();
    this.minis = new Map();
    this.minisDue = new Map();
  }

  draw(layout, machine, problems) {
    this.clear();
    this.problems = new Map();
    for (const one of problems)
      this.problems.set(one.path, [...(this.problems.get(one.path) ?? []), one]);
    this.edgesAbove = document.createDocumentFragment();
    const picture = document.createDocumentFragment();
    this.root = machine.root;
    this.svg.classList.toggle("compared", machine.order.some((n) => n.change || n.note || n.edges.some((e) => e.change || e.note)));
    this.size = { x: 0, y: 0, w: layout.w + 16, h: layout.h + 16 };
    this.#container(layout, 8, 8, picture);
    this.world.replaceChildren(picture);
    this.#miniature();
  }

  boxOf(path) { return this.boxes.get(path); }

  // -- building ---------------------------------------------------------------------------------

  #container(layout, x, y, into) {
    const { node } = layout;
    const box = { x, y, w: layout.w, h: layout.h };
    this.boxes.set(node.path, box);
    const group = this.#group(node, `box ${node.kind}`);
    group.append(el("rect", { class: "frame", x, y, width: box.w, height: box.h, rx: 9 }));
    group.firstChild.style.fill = `var(--depth${Math.min(node.depth, 11)})`;
    group.append(icon(node.kind, x + 9, y + 7.5));
    const title = el("text", { x: x + 24, y: y + 16.5, class: "title" }, node.shown);
    if (TAGS[node.kind]) title.append(el("tspan", { dx: 7, class: "tag" }, TAGS[node.kind]));
    group.append(title);
    this.#extras(group, node, { ...box, h: 26 });
    into.append(group);
    for (const edge of layout.edges) into.append(this.#edge(edge, x, y));
    for (const child of layout.boxes) {
      if (child.inner) this.#container(child.inner, x + child.x, y + child.y, into);
      else this.#leaf(child, x + child.x, y + child.y, into);
    }
    for (const edge of layout.edges) this.#edgeLabels(edge, x, y, into);
    if (layout.entry)
      into.append(el("circle", { class: "entry", cx: x + layout.entry.x, cy: y + layout.entry.y, r: 4.5 }));
    for (const pill of layout.pills) into.append(this.#pill(node, pill, x, y));
  }

  #group(node, className) {
    const group = el("g", { class: `${className}${node.change ? ` cmp-${node.change}` : ""}`, "data-path": node.path, role: "button", tabindex: -1,
      "aria-label": `${node.label}, ${KIND_NAMES[node.kind] ?? node.kind}` });
    const details = node.details.map(([k, v]) => `${k}: ${v}`).join("\n");
    const found = (this.problems.get(node.path) ?? []).map((p) => `\u26a0 ${p.text}`).join("\n");
    group.note = node.note;
    group.change = node.change;
    const words = [node.path, node.change, node.note, `${node.type_name} (${KIND_NAMES[node.kind] ?? node.kind})`, node.doc, details, found];
    this.nodes.set(node.path, group);
    queueMicrotask(() => group.prepend(el("title", {}, words.filter(Boolean).join("\n").slice(0, 2000))));
    return group;
  }

  #leaf(place, x, y, into) {
    const { node } = place;
    this.boxes.set(node.path, { x, y, w: place.w, h: place.h });
    const closed = node.children.length > 0;
    const group = this.#group(node, `leaf ${node.kind}${closed ? " closed" : ""}`);
    group.append(el("rect", { class: "frame", x, y, width: place.w, height: place.h, rx: 7 }));
    if (closed)
      group.append(el("rect", { class: "inner", x: x + 2.5, y: y + 2.5, width: place.w - 5, height: place.h - 5, rx: 5 }));
    const bar = el("rect", { class: "progress", x: x + 6, y: y + place.h - 4.6, width: place.w - 12, height: 2.6, rx: 1.3 });
    bar.style.transformOrigin = `${x + 6}px 0`;
    group.append(bar);
    group.bar = bar;
    const nameWidth = measure(node.shown, 11, true) + 14;
    const spare = closed ? 20 + measure(String(node.total - 1), 9) : 0;
    const left = place.rows ? x + 10 : x + (place.w - nameWidth - spare) / 2;
    const middle = y + place.h / 2;
    group.append(icon(node.kind, left, middle - 5));
    group.append(el("text", { class: "name", x: left + 14, y: middle + 3.9 }, node.shown));
    if (closed)
      group.append(el("text", { class: "inside", x: left + nameWidth + 7, y: middle + 3.4 }, `\u229e ${node.total - 1}`));
    for (const dot of place.dots) {
      const kind = outcomeClass(dot.outcome);
      group.append(el("circle", { class: `dot ${kind}`, cx: x + dot.x, cy: y + dot.y, r: 3.2 }));
      group.append(el("text", { class: `outcome ${kind}`, x: x + dot.x - 7, y: y + dot.y + 3.1, "text-anchor": "end" }, dot.outcome));
    }
    const room = place.dots.length ? place.nameWidth : place.w; // its outcomes are right of that
    this.#extras(group, node, { x, y, w: place.w, h: place.h }, room);
    into.append(group);
  }

  // Badges that appear when there is something to say.
  #extras(group, node, box, room = box.w) {
    const badge = el("text", { class: "badge", x: box.x + box.w - 5, y: box.y - 3, "text-anchor": "end" });
    group.append(badge);
    group.badge = badge;
    const glyph = el("text", { class: "glyph", x: box.x + room - 8, y: box.y + 10, "text-anchor": "middle" });
    group.append(glyph);
    group.glyph = glyph;
    const found = this.problems.get(node.path);
    if (found) {
      group.classList.add("problem");
      const worst = found.some((p) => p.severity === "error") ? "failure" : "preempted";
      group.append(el("circle", { class: `warning ${worst}`, cx: box.x + 2, cy: box.y + 2, r: 6.5 }));
      group.append(el("text", { class: "warning-text", x: box.x + 2, y: box.y + 5.4, "text-anchor": "middle" }, "!"));
    }
    group.append(el("circle", { class: "stop", cx: box.x - 1, cy: box.y + Math.min(box.h, 26) / 2, r: 5 }));
  }

  #edge(edge, x, y) {
    const points = edge.points.map((p) => ({ x: p.x + x, y: p.y + y }));
    const kind = edge.kind === "link" ? classOfAll(edge.outcomes) : edge.kind;
    const implicit = edge.link?.implicit ? " implicit" : "";
    const change = edge.link?.change ? ` cmp-${edge.link.change}` : "";
    const path = el("path", { class: `edge ${kind}${implicit}${change}`, d: rounded(points),
      "marker-end": `url(#arrow-${edge.kind === "link" ? kind : "plain"})` });
    for (const outcome of edge.outcomes) {
      const key = edge.source + SEP + outcome;
      this.arrows.set(key, [...(this.arrows.get(key) ?? []), path]);
    }
    path.about = edge;
    return path;
  }

  #edgeLabels(edge, x, y, into) {
    for (const label of edge.labels) {
      const text = el("text", { class: `label ${outcomeClass(label.text)}`, x: x + label.x,
        y: y + label.y + 9.2, "text-anchor": "middle" }, signed(edge.link?.change, label.text));
      into.append(text);
    }
    if (edge.kind !== "link") return;
    const { change, note } = edge.link;
    const said = [!edge.labels.length && change ? SIGNS[change] : "", note].filter(Boolean).join(" ");
    const middle = longest(edge.points);
    const right = !edge.labels.some((label) => label.x > middle.x); // not where the names are
    const count = el("text", { class: "count", x: x + middle.x + (right ? 4 : -4), y: y + middle.y - 3,
      "text-anchor": right ? "start" : "end" }, said);
    count.said = said;
    into.append(count);
    for (const path of this.arrows.get(edge.source + SEP + edge.outcomes[0]) ?? [])
      if (path.about === edge) path.count = count;
  }

  #pill(node, pill, x, y) {
    const kind = outcomeClass(pill.outcome);
    const byDefault = node.pills.find((p) => p.outcome === pill.outcome)?.by_default ? " default" : "";
    const group = el("g", { class: `pill ${kind}${byDefault}` });
    const place = { x: x + pill.x, y: y + pill.y, width: pill.w, height: pill.h, rx: pill.h / 2 };
    group.append(el("rect", place));
    group.append(el("text", { x: place.x + pill.w / 2, y: place.y + pill.h / 2 + 3.1, "text-anchor": "middle" }, pill.outcome));
    this.nodes.set(`${node.path}${SEP}${pill.outcome}`, group);
    return group;
  }

  #miniature() {
    const { w, h } = this.size;
    this.minimap.setAttribute("viewBox", `0 0 ${w} ${h}`);
    const rects = [];
    for (const [path, box] of this.boxes) {
      const rect = el("rect", { class: this.nodes.get(path).classList.contains("box") ? "area" : "spot",
        x: box.x, y: box.y, width: box.w, height: box.h, rx: 6 });
      this.minis.set(path, rect);
      rects.push(rect);
    }
    this.window = el("rect", { class: "window" });
    this.minimap.replaceChildren(...rects, this.window);
  }

  showWindow(view) {
    if (!this.window) return;
    const { x, y, k, width, height } = view;
    for (const [name, value] of [["x", -x / k], ["y", -y / k], ["width", width / k], ["height", height / k]])
      this.window.setAttribute(name, value);
    this.window.style.strokeWidth = `${Math.max(this.size.w, this.size.h) / 70}px`;
    const { w, h } = this.size;
    const all = x >= -1 && y >= -1 && x + w * k <= width + 1 && y + h * k <= height + 1;
    this.minimap.classList.toggle("idle", all);
    this.svg.classList.toggle("far", k < 0.6);
    this.svg.classList.toggle("farther", k < 0.35);
    this.svg.style.setProperty("--title", `${Math.max(11, Math.min(11 / k, 44)).toFixed(1)}px`);
  }

  // -- restyling --------------------------------------------------------------------------------

  // `goal`: what the state has sent and waits for; `unserved`: nobody is seen who would take it.
  paint(path, state, now, goal, unserved = false) {
    const group = this.nodes.get(path);
    if (!group) return;
    const active = state?.since != null;
    const classes = group.classList;
    const kind = state?.outcome != null ? outcomeClass(state.outcome) : null;
    classes.toggle("active", active);
    classes.toggle("preempting", active && !!state.preempt);
    classes.toggle("serviced", active && !!state.preempt && !!state.serviced);
    classes.toggle("waiting", !!state?.waits || (active && unserved));
    classes.toggle("visited", (state?.visits ?? 0) > 0);
    for (const name of ["success", "failure", "preempted", "other"])
      classes.toggle(`was-${name}`, !active && kind === name);
    classes.toggle("raised", !active && !!state?.error);
    classes.toggle("faded", !active && state?.left != null && now - ms(state.left) > FADE_MS);
    write(group.glyph, glyph(state, active, kind));
    write(group.badge, active ? elapsed(state, now) : group.note || "");
    const part = active ? goal?.progress?.fraction ?? 0 : 0;
    if (group.bar && group.bar.part !== part) group.bar.style.transform = `scaleX(${group.bar.part = part})`;
    const status = active ? (state.preempt ? `asked to stop${state.serviced ? ", takes it up" : ""}` : unserved ? `no server of ${goal.action} seen` : "running") : state?.outcome ?? "not visited";
    const label = `${path}, ${status}${group.change ? `, ${group.change}` : ""}`;
    if (group.label !== label) group.setAttribute("aria-label", group.label = label);
    this.minisDue.set(path, active);
  }

  // The small map follows a few times a second: drawing it at every event costs as much as the rest.
  paintMinis() {
    for (const [path, active] of this.minisDue) this.minis.get(path)?.classList.toggle("active", active);
    this.minisDue.clear();
  }

  tickBadge(path, state, now) {
    const group = this.nodes.get(path);
    if (group && state.since != null) write(group.badge, elapsed(state, now));
  }

  flash(path, outcome, now) {
    for (const edge of this.arrows.get(path + SEP + outcome) ?? []) {
      edge.classList.add("taken");
      this.flashing.set(edge, now + FLASH_MS);
    }
  }
  unflash(now) {
    for (const [edge, until] of this.flashing)
      if (until < now) { edge.classList.remove("taken"); this.flashing.delete(edge); }
    return this.flashing.size > 0;
  }

  mark(paths, name) {
    for (const group of this.world.querySelectorAll(`.${name}`)) group.classList.remove(name);
    for (const path of paths) this.nodes.get(path)?.classList.add(name);
  }

  // Heat: `weigh(path, outcome)` gives {count, share} of a transition or null, `tone(path)` 0 to 1.
  heat(weigh, tone) {
    this.svg.classList.toggle("heated", !!weigh);
    for (const edges of this.arrows.values())
      for (const edge of edges) {
        const found = weigh ? edge.about.outcomes.map((o) => weigh(edge.about.source, o)).filter(Boolean) : [];
        const count = found.reduce((sum, one) => sum + one.count, 0);
        const share = found.reduce((sum, one) => sum + (one.share ?? 0), 0);
        edge.style.strokeWidth = count ? `${Math.min(4, 1.2 + Math.log2(1 + count) * 0.6)}px` : "";
        edge.classList.toggle("never", !!weigh && !count);
        if (edge.count)
          edge.count.textContent = !weigh || !count ? edge.count.said : `\u00d7${count}${share && share < 0.995 ? ` ${Math.round(share * 100)}%` : ""}`;
      }
    for (const [path, group] of this.nodes) {
      const value = weigh && tone ? tone(path) : null;
      const frame = group.querySelector(".frame");
      if (frame && !group.classList.contains("box"))
        frame.style.fill = value ? `color-mix(in srgb, var(--failure-fill) ${Math.round(value * 100)}%, var(--inactive-fill))` : "";
    }
  }
}

const longest = (points) => {
  let best = { x: points[0].x, y: points[0].y, length: -1 };
  for (let i = 1; i < points.length; i++) {
    const [a, b] = [points[i - 1], points[i]];
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    if (length > best.length) best = { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, length };
  }
  return best;
};

function glyph(state, active, kind) {
  if (state?.waits) return "\u23f8";
  if (active && state.preempt) return state.serviced ? "\u2713" : "\u25a0";
  if (active || !kind) return "";
  if (state.error) return "\u26a0";
  return { success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "" }[kind];
}

// Text is laid out anew whenever it is set, so it is set only when it is another one.
function write(element, text) {
  if (element.shown === text) return;
  element.shown = text;
  element.textContent = text;
}

export function span(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min ${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
  return `${Math.floor(seconds / 3600)} h ${String(Math.floor((seconds % 3600) / 60)).padStart(2, "0")}`;
}

function elapsed(state, now) {
  const parts = [], lasted = now - ms(state.since);
  if (lasted < BRIEF_MS && !state.preempt && !(state.attempt > 1)) return "";
  if (state.item != null) parts.push(`#${state.item + 1}`);
  if (state.attempt > 1) parts.push(`attempt ${state.attempt}`);
  if (state.preempt) {
    const grace = state.asked?.grace, asked = span(Math.max(0, now - ms(state.preempt)) / 1000);
    parts.push(state.serviced ? `cleans up ${span(Math.max(0, now - ms(state.serviced)) / 1000)}` : `asked to stop ${asked}${grace != null ? ` of ${span(grace)}` : ""}`);
  }
  else parts.push(span(Math.max(0, lasted) / 1000));
  return parts.join(" \u00b7 ");
}

function markers() {
  const made = ["success", "failure", "preempted", "other", "plain"].map((kind) =>
    el("marker", { id: `arrow-${kind}`, class: `arrow ${kind}`, viewBox: "0 0 10 10", refX: 9, refY: 5,
      markerWidth: 6.5, markerHeight: 6.5, markerUnits: "userSpaceOnUse", orient: "auto-start-reverse" },
    el("path", { d: "M0 1 10 5 0 9Z" })));
  return el("defs", {}, ...made);
}

export const isContainer = (node) => CONTAINERS.has(node.kind);
