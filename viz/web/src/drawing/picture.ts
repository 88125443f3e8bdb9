// The picture of a machine: SVG elements that are built once per layout. What changes of them later is kept by path.

import { containerOf } from "#core/fold.ts";
import type { Model } from "#core/model.ts";
import { CHANGE_SIGNS, isPartOfNet, joinText, KIND_NAMES, signed } from "#core/model.ts";
import { commonClass, endClass, outcomeClass } from "#core/outcomes.ts";
import { shorten } from "#core/text.ts";
import type { Box, Join, Problem, StateNode } from "#core/types.ts";
import { fitting, measure } from "#drawing/measure.ts";
import { type ContainerLayout, type PlacedBox, type PlacedEdge, type PlacedPill, SEP } from "#drawing/placed.ts";
import { el, icon, middleOfLongest, roundedLine } from "#drawing/svg.ts";

const TAGS: Record<string, string> = { concurrence: "concurrent", iterator: "repeats", sequence: "sequence" };

/** The elements of a state that change while it runs. Browsers lay a text out whenever it is set, even to the same
 * value, so the last value is kept to skip that. */
export type StateView = {
  group: SVGElement;
  frame: SVGElement;
  badge: TextOf;
  glyph: TextOf;
  bar: SVGElement | null;
  part: number;
  label: string;
  isBlank: boolean; // painted as a state that has not run: most are in a large machine
  node: StateNode;
};
export type TextOf = { element: SVGElement; text: string };
export type Arrow = { line: SVGElement; edge: PlacedEdge; count: SVGElement | null; note: string };
/** a bar, with the lines that end there by child and outcome */
export type JoinView = { join: Join; path: string; text: TextOf | null; lines: Map<string, SVGElement> };

export class Picture {
  states: Map<string, StateView> = new Map();
  arrows: Map<string, Arrow[]> = new Map(); // by path of the state and outcome
  joins: Map<string, JoinView[]> = new Map(); // by path of the container
  boxes: Map<string, Box> = new Map();
  cards: Map<string, TextOf> = new Map(); // texts of the branches that are cards
  pills: Map<string, SVGElement> = new Map(); // by path of the container and outcome
  size: Box | null = null; // null: nothing is drawn yet
  #model: Model | null = null;
  #problems: Map<string, Problem[]> = new Map();

  /** Build the elements of a layout. */
  build(layout: ContainerLayout, model: Model, problems: Problem[]) {
    this.#model = model;
    this.#problems = groupByPath(problems);
    this.size = { x: 0, y: 0, w: layout.w + 16, h: layout.h + 16 };
    const built = document.createDocumentFragment();
    this.#container(layout, 8, 8, built);
    return built;
  }

  #container(layout: ContainerLayout, x: number, y: number, into: DocumentFragment) {
    const { node } = layout;
    const box = { x, y, w: layout.w, h: layout.h };
    this.boxes.set(node.path, box);
    const group = this.#group(node, `box ${node.kind}`);
    const frame = el("rect", { class: "frame", x, y, width: box.w, height: box.h, rx: 9 });
    frame.style.fill = `var(--depth${Math.min(node.depth, 11)})`;
    const name = measure(node.shown, 11, true) + (TAGS[node.kind] ? 60 : 0);
    const entry = layout.entry && layout.entry.y < 8 ? layout.entry.x : -1; // where a line enters at the top
    const isCrossed = entry > 4 && entry < 30 + name && entry + 26 + name < box.w;
    const left = isCrossed ? x + entry - 2 : x;
    const title = el("text", { x: left + 24, y: y + 13.5, class: "title" }, node.shown);
    // Zoomed out, titles are larger than the rest; but they stay inside of their container.
    const room = x + box.w - left - 42; // without the icon and the mark of its outcome
    title.style.setProperty("--longest", `${Math.max(11, (11 * room) / name).toFixed(1)}px`);
    if (layout.head) {
      // a tile of the overview
      const size = 0.5 * layout.head;
      title.setAttribute("y", String(y + 0.7 * layout.head));
      title.setAttribute("x", String(x + 8));
      title.style.fontSize = `${size}px`;
    } else if (TAGS[node.kind]) title.append(el("tspan", { dx: 7, class: "tag" }, TAGS[node.kind]));
    group.append(frame, ...(layout.head ? [] : [icon(node.kind, left + 9, y + 7.5)]), title);
    this.#register(node, group, frame, null, { ...box, h: 26 }, box.w);
    into.append(group);
    if (layout.joins.length)
      this.joins.set(
        node.path,
        node.joins.map((join) => ({ join, path: node.path, text: null, lines: new Map() })),
      );
    for (const edge of layout.edges) into.append(this.#edge(edge, x, y));
    for (const child of layout.boxes) {
      if (child.inner) this.#container(child.inner, x + child.x, y + child.y, into);
      else this.#leaf(child, x + child.x, y + child.y, into);
    }
    for (const edge of layout.edges) this.#edgeLabels(edge, x, y, into);
    if (layout.entry)
      into.append(el("circle", { class: "entry", cx: x + layout.entry.x, cy: y + layout.entry.y, r: 4.5 }));
    for (const { join, ...place } of layout.joins)
      into.append(
        el(
          "rect",
          { class: "join", x: x + place.x, y: y + place.y, width: place.w, height: place.h, rx: 3 },
          el("title", {}, join?.text ?? "the rules of this concurrence"),
        ),
      );
    for (const pill of layout.pills) {
      const drawn = outcomePill(node, pill, x, y);
      this.pills.set(node.path + SEP + pill.outcome, drawn);
      into.append(drawn);
    }
  }

  #group(node: StateNode, className: string) {
    const kind = KIND_NAMES[node.kind] ?? node.kind;
    const group = el("g", {
      class: `${className}${node.change ? ` cmp-${node.change}` : ""}`,
      "data-path": node.path,
      role: "button",
      tabindex: -1,
      "aria-label": `${node.label}, ${kind}`,
    });
    const details = node.details.map(([name, value]) => `${name}: ${value}`).join("\n");
    const found = (this.#problems.get(node.path) ?? []).map((one) => `\u26a0 ${one.text}`).join("\n");
    const lines = [node.path, node.change, node.note, `${node.type_name} (${kind})`, node.doc, details, found];
    queueMicrotask(() => group.prepend(el("title", {}, lines.filter(Boolean).join("\n").slice(0, 2000))));
    return group;
  }

  #leaf(place: PlacedBox, x: number, y: number, into: DocumentFragment) {
    const { node, w, h } = place;
    this.boxes.set(node.path, { x, y, w, h });
    const closed = node.children.length > 0;
    const group = this.#group(node, `leaf ${node.kind}${closed ? " closed" : ""}${place.card ? " card" : ""}`);
    const isNet = isPartOfNet(node);
    const rx = isNet ? (node.kind === "transition" ? 0 : h / 2) : 7;
    const frame = el("rect", { class: "frame", x, y, width: w, height: h, rx });
    group.append(frame);
    if (closed && !place.card)
      group.append(el("rect", { class: "inner", x: x + 2.5, y: y + 2.5, width: w - 5, height: h - 5, rx: 5 }));
    const bar = el("rect", { class: "progress", x: x + 6, y: y + h - 4.6, width: w - 12, height: 2.6, rx: 1.3 });
    bar.style.transformOrigin = `${x + 6}px 0`;
    bar.style.transform = "scaleX(0)";
    group.append(bar);
    if (place.card) {
      this.#card(place, group, x, y);
      this.#register(node, group, frame, bar, { x, y: y + 20, w, h }, w);
      into.append(group);
      return;
    }
    const nameWidth = measure(node.shown, 11, true) + 14;
    const spare = closed ? 20 + measure(String(node.total - 1), 9) : 0;
    const left = place.hasRows ? x + 10 : x + (w - nameWidth - spare) / 2;
    const middle = y + h / 2;
    if (!isNet) group.append(icon(node.kind, left, middle - 5));
    group.append(el("text", { class: "name", x: left + (isNet ? 7 : 14), y: middle + 3.9 }, node.shown));
    if (closed) {
      const inside = `\u229e ${node.total - 1}`;
      group.append(el("text", { class: "inside", x: left + nameWidth + 7, y: middle + 3.4 }, inside));
    }
    for (const dot of place.dots) {
      const kind = endClass(node, dot.outcome);
      const end = { x: x + dot.x - 7, y: y + dot.y + 3.1, "text-anchor": "end" };
      group.append(el("circle", { class: `dot ${kind}`, cx: x + dot.x, cy: y + dot.y, r: 3.2 }));
      group.append(el("text", { class: `outcome ${kind}`, ...end }, shorten(dot.outcome)));
    }
    const room = place.dots.length ? place.nameWidth : w; // the outcomes are right of the name
    this.#register(node, group, frame, bar, { x, y, w, h }, room);
    into.append(group);
  }

  /** Write the name of a branch, and below it what runs in it. */
  #card({ node, w }: PlacedBox, group: SVGElement, x: number, y: number) {
    const inside = el("text", { class: "doing", x: x + 10, y: y + 36 }, "");
    group.append(
      icon(node.kind, x + 9, y + 9),
      el("text", { class: "name", x: x + 24, y: y + 18 }, fitting(node.shown, w - 70)),
    );
    group.append(inside);
    this.cards.set(node.path, { element: inside, text: "" });
  }

  /**
   * Add the badges, which are empty at first, and keep the elements that change.
   * @param room for the name
   */
  #register(node: StateNode, group: SVGElement, frame: SVGElement, bar: SVGElement | null, box: Box, room: number) {
    const badge = el("text", { class: "badge", x: box.x + box.w - 5, y: box.y - 3, "text-anchor": "end" });
    const glyph = el("text", { class: "glyph", x: box.x + room - 8, y: box.y + 10, "text-anchor": "middle" });
    group.append(badge, glyph);
    const found = this.#problems.get(node.path);
    if (found) {
      group.classList.add("problem");
      const worst = found.some((one) => one.severity === "error") ? "failure" : "preempted";
      const centre = { x: box.x + 2, y: box.y + 5.4, "text-anchor": "middle" };
      group.append(el("circle", { class: `warning ${worst}`, cx: box.x + 2, cy: box.y + 2, r: 6.5 }));
      group.append(el("text", { class: "warning-text", ...centre }, "!"));
    }
    group.append(el("circle", { class: "stop", cx: box.x - 1, cy: box.y + Math.min(box.h, 26) / 2, r: 5 }));
    this.states.set(node.path, {
      group,
      frame,
      bar,
      badge: { element: badge, text: "" },
      glyph: { element: glyph, text: "" },
      part: 0,
      label: "",
      isBlank: false,
      node,
    });
  }

  #edge(edge: PlacedEdge, x: number, y: number) {
    const points = edge.points.map((p) => ({ x: p.x + x, y: p.y + y }));
    const kind = edge.kind === "link" ? commonClass(this.#model?.get(edge.source), edge.outcomes) : edge.kind;
    const implicit = edge.link?.implicit ? " implicit" : "";
    const change = edge.link?.change ? ` cmp-${edge.link.change}` : "";
    const line = el("path", {
      class: `edge ${kind}${implicit}${change}`,
      d: roundedLine(points),
      "marker-end": `url(#arrow-${edge.kind === "link" ? kind : "plain"})`,
    });
    if (edge.link && edge.link.join !== null) {
      const lines = this.joins.get(containerOf(edge.source))?.[edge.link.join]?.lines;
      for (const outcome of edge.outcomes) lines?.set(edge.link.source + SEP + outcome, line);
    }
    const arrow = { line, edge, count: null, note: "" };
    for (const { source, outcomes } of edge.also ?? [edge])
      for (const outcome of outcomes) {
        const key = source + SEP + outcome;
        this.arrows.set(key, [...(this.arrows.get(key) ?? []), arrow]);
      }
    return line;
  }

  #edgeLabels(edge: PlacedEdge, x: number, y: number, into: DocumentFragment) {
    if (edge.join) {
      const [place] = edge.labels;
      const known = this.joins.get(edge.source)?.find((one) => one.join === edge.join);
      if (!place || !known) return;
      const text = joinText(edge.join, 0);
      const at = { x: x + place.x, y: y + place.y + 9.2, "text-anchor": "middle" };
      known.text = { element: el("text", { class: "label joined", ...at }, text), text };
      into.append(known.text.element);
      return;
    }
    for (const label of edge.labels) {
      const place = { x: x + label.x, y: y + label.y + 9.2, "text-anchor": "middle" };
      const name = signed(edge.link?.change, shorten(label.text));
      const kind = endClass(this.#model?.get(edge.source), label.text);
      into.append(el("text", { class: `label ${kind}`, ...place }, name));
    }
    if (!edge.link) return;
    const { change, note } = edge.link;
    const text = [!edge.labels.length && change ? CHANGE_SIGNS[change] : "", note].filter(Boolean).join(" ");
    const middle = middleOfLongest(edge.points);
    const right = !edge.labels.some((label) => label.x > middle.x); // on the side without names
    const place = {
      x: x + middle.x + (right ? 4 : -4),
      y: y + middle.y - 3,
      "text-anchor": right ? "start" : "end",
    };
    const count = el("text", { class: "count", ...place }, text);
    into.append(count);
    for (const arrow of this.arrows.get(edge.source + SEP + edge.outcomes[0]) ?? [])
      if (arrow.edge === edge) Object.assign(arrow, { count, note: text });
  }
}

function outcomePill(node: StateNode, pill: PlacedPill, x: number, y: number) {
  const byDefault = node.pills.find((one) => one.outcome === pill.outcome)?.by_default ? " default" : "";
  const shown = pill.from ? `${shorten(pill.outcome)}, from ${pill.from}` : shorten(pill.outcome);
  const place = { x: x + pill.x, y: y + pill.y, width: pill.w, height: pill.h, rx: pill.h / 2 };
  const centre = { x: place.x + pill.w / 2, y: place.y + pill.h / 2 + 3.1, "text-anchor": "middle" };
  return el(
    "g",
    { class: `pill ${outcomeClass(pill.outcome)}${byDefault}` },
    el("rect", place),
    el("text", centre, shown),
    ...(shown === pill.outcome ? [] : [el("title", {}, shorten(pill.outcome, 400))]),
  );
}

function groupByPath(problems: Problem[]) {
  const found: Map<string, Problem[]> = new Map();
  for (const one of problems) found.set(one.path, [...(found.get(one.path) ?? []), one]);
  return found;
}
