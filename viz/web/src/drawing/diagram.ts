// The diagram: SVG elements are built once per layout; events only change their classes and texts.

import { containerOf, ms, own } from "#core/fold.ts";
import type { Model } from "#core/model.ts";
import { CHANGE_SIGNS, isInCleanup, isPartOfNet, joinText, KIND_NAMES, signed } from "#core/model.ts";
import { commonClass, endClass, outcomeClass } from "#core/outcomes.ts";
import type { CountOf, HeatOf } from "#core/statistics.ts";
import { duration, shorten } from "#core/text.ts";
import type { Box, GoalRun, Join, OutcomeClass, Problem, StateNode, StateRun } from "#core/types.ts";
import { measure } from "#drawing/measure.ts";
import type { ContainerLayout, PlacedBox, PlacedEdge, PlacedPill } from "#drawing/placed.ts";
import { arrowHeads, el, icon, middleOfLongest, roundedLine } from "#drawing/svg.ts";
import type { Viewport } from "#drawing/viewport.ts";

const SEP = "\u0001";
const FLASH_MS = 380;
const FADE_MS = 5000;
const BRIEF_MS = 400; // a state shows its clock after this time
const MINIMAP_BELOW = 0.6; // the minimap is shown if a smaller part of the machine is in view
const CORNERS = ["bottom-right", "bottom-left", "top-right", "top-left"];
const CLASSES = ["success", "failure", "preempted", "other"];
const CARD_TEXT = 118; // room for a text in a card
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
  node: StateNode;
};
export type TextOf = { element: SVGElement; text: string };
export type Arrow = { line: SVGElement; edge: PlacedEdge; count: SVGElement | null; note: string };
/** a bar, with
 * the lines that end there by child and outcome */
export type JoinView = { join: Join; path: string; text: TextOf | null; lines: Map<string, SVGElement> };

export class Diagram {
  svg: SVGSVGElement;
  minimap: SVGSVGElement;
  world: SVGElement;
  states: Map<string, StateView> = new Map();
  arrows: Map<string, Arrow[]> = new Map(); // by path of the state and outcome
  joins: Map<string, JoinView[]> = new Map(); // by path of the container
  boxes: Map<string, Box> = new Map();
  cards: Map<string, TextOf> = new Map(); // texts of the branches that are cards
  pills: Map<string, SVGElement> = new Map(); // by path of the container and outcome
  minimapRects: Map<string, SVGElement> = new Map();
  minimapDue: Map<string, boolean> = new Map(); // changes for the minimap: path -> whether the state is active
  flashing: Map<SVGElement, number> = new Map(); // end of the flash of each element [ms]
  problems: Map<string, Problem[]> = new Map();
  model: Model | null = null; // the one that is drawn
  size: Box | null = null;
  window: SVGElement | null = null; // the part in view, on the minimap

  constructor(svg: SVGSVGElement, minimap: SVGSVGElement) {
    this.svg = svg;
    this.minimap = minimap;
    this.world = el("g", { class: "world" });
    svg.replaceChildren(arrowHeads(), this.world);
  }

  draw(layout: ContainerLayout, model: Model, problems: Problem[]) {
    const { states, arrows, joins, boxes, cards, pills, minimapRects, minimapDue } = this;
    for (const map of [states, arrows, joins, boxes, cards, pills, minimapRects, minimapDue]) map.clear();
    this.model = model;
    this.problems = groupByPath(problems);
    const isCompared = model.order.some((n) => n.change || n.note || n.edges.some((e) => e.change || e.note));
    this.svg.classList.toggle("compared", isCompared);
    this.size = { x: 0, y: 0, w: layout.w + 16, h: layout.h + 16 };
    const picture = document.createDocumentFragment();
    this.#container(layout, 8, 8, picture);
    this.world.replaceChildren(picture);
    this.#drawMinimap(this.size);
  }

  boxOf(path: string | null) {
    return path === null ? undefined : this.boxes.get(path);
  }

  // -- building ---------------------------------------------------------------------------------

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
    const title = el("text", { x: left + 24, y: y + 16.5, class: "title" }, node.shown);
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
    const found = (this.problems.get(node.path) ?? []).map((one) => `\u26a0 ${one.text}`).join("\n");
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

  /** Write into the cards what they say now. */
  paintCards(textOf: (path: string) => string) {
    for (const [path, card] of this.cards) write(card, fitting(textOf(path), CARD_TEXT));
  }

  /**
   * Add the badges, which are empty at first, and keep the elements that change.
   * @param room for the name
   */
  #register(node: StateNode, group: SVGElement, frame: SVGElement, bar: SVGElement | null, box: Box, room: number) {
    const badge = el("text", { class: "badge", x: box.x + box.w - 5, y: box.y - 3, "text-anchor": "end" });
    const glyph = el("text", { class: "glyph", x: box.x + room - 8, y: box.y + 10, "text-anchor": "middle" });
    group.append(badge, glyph);
    const found = this.problems.get(node.path);
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
      node,
    });
  }

  #edge(edge: PlacedEdge, x: number, y: number) {
    const points = edge.points.map((p) => ({ x: p.x + x, y: p.y + y }));
    const kind = edge.kind === "link" ? commonClass(this.model?.get(edge.source), edge.outcomes) : edge.kind;
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
      const kind = endClass(this.model?.get(edge.source), label.text);
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

  #drawMinimap({ w, h }: Box) {
    this.minimap.setAttribute("viewBox", `0 0 ${w} ${h}`);
    for (const [path, box] of this.boxes) {
      const isOpen = this.states.get(path)?.group.classList.contains("box");
      const place = { x: box.x, y: box.y, width: box.w, height: box.h, rx: 6 };
      this.minimapRects.set(path, el("rect", { class: isOpen ? "area" : "spot", ...place }));
    }
    this.window = el("rect", { class: "window" });
    this.minimap.replaceChildren(...this.minimapRects.values(), this.window);
  }

  /** Show on the minimap which part is in view. */
  showWindow(view: Viewport) {
    if (!this.window || !this.size) return;
    const { x, y, k, width, height } = view;
    const place = { x: -x / k, y: -y / k, width: width / k, height: height / k };
    for (const [name, value] of Object.entries(place)) this.window.setAttribute(name, String(value));
    const { w, h } = this.size;
    this.window.style.strokeWidth = `${Math.max(w, h) / 70}px`;
    const seen = (from: number, size: number, room: number) =>
      Math.max(0, Math.min(room, from + size * k) - Math.max(0, from)) / (size * k);
    const isIdle = seen(x, w, width) * seen(y, h, height) > MINIMAP_BELOW;
    this.minimap.classList.toggle("idle", isIdle);
    if (!isIdle) this.minimap.setAttribute("data-corner", this.#freeCorner(view));
    this.svg.classList.toggle("far", k < 0.6);
    this.svg.classList.toggle("farther", k < 0.35);
    this.svg.style.setProperty("--title", `${Math.max(11, Math.min(11 / k, 44)).toFixed(1)}px`);
  }

  /** The corner of the view where the minimap covers the fewest states. */
  #freeCorner({ x, y, k, width, height }: Viewport) {
    const [w, h] = [this.minimap.clientWidth + 20, this.minimap.clientHeight + 20];
    const covered = Object.fromEntries(CORNERS.map((corner) => [corner, 0]));
    for (const [path, box] of this.boxes) {
      if (this.states.get(path)?.group.classList.contains("box")) continue;
      const [left, top] = [box.x * k + x, box.y * k + y];
      const [right, bottom] = [left + box.w * k, top + box.h * k];
      for (const corner of CORNERS) {
        const atX = corner.endsWith("right") ? right > width - w && left < width : left < w && right > 0;
        const atY = corner.startsWith("bottom") ? bottom > height - h && top < height : top < h && bottom > 0;
        if (atX && atY) covered[corner] += 1;
      }
    }
    const now = this.minimap.getAttribute("data-corner") ?? CORNERS[0];
    return CORNERS.reduce((best, one) => (covered[one] < covered[best] ? one : best), now);
  }

  // -- restyling --------------------------------------------------------------------------------

  /**
   * @param now [ms]
   * @param goal the goal that the state waits for
   * @param noServer no action server is seen that would take it
   */
  paint(
    path: string,
    state: StateRun | undefined,
    now: number,
    goal: GoalRun | null | undefined,
    noServer: boolean = false,
  ) {
    const view = this.states.get(path);
    if (!view || isPartOfNet(view.node)) return;
    const active = state?.since != null;
    const asked = active && Boolean(state?.preempt);
    const kind = state?.outcome != null ? endClass(view.node, state.outcome) : null;
    const classes = view.group.classList;
    classes.toggle("active", active);
    classes.toggle("preempting", asked);
    classes.toggle("serviced", asked && Boolean(state?.serviced));
    const asks = active && state.question?.answered === null;
    classes.toggle("waiting", Boolean(state?.waits) || (active && noServer) || asks);
    classes.toggle("visited", (state?.visits ?? 0) > 0);
    for (const name of CLASSES) classes.toggle(`was-${name}`, !active && kind === name);
    classes.toggle("raised", !active && Boolean(state?.error));
    classes.toggle("faded", !active && state?.left != null && now - state.left / 1e6 > FADE_MS);
    write(view.glyph, glyphOf(state, kind));
    write(view.badge, active ? elapsed(view.node, state, now) : view.node.note || "");
    const part = active ? (goal?.progress?.fraction ?? 0) : 0;
    if (view.bar && view.part !== part) {
      view.part = part;
      view.bar.style.transform = `scaleX(${part})`;
    }
    const label = [path, statusOf(state, goal, noServer), view.node.change].filter(Boolean).join(", ");
    if (view.label !== label) {
      view.label = label;
      view.group.setAttribute("aria-label", label);
    }
    this.minimapDue.set(path, active);
  }

  /** Show at the joins of a container how many conditions were met in its visit. */
  paintJoins(path: string, states: Record<string, StateRun>) {
    const since = own(states, path)?.since ?? null;
    for (const { join, text, lines } of this.joins.get(path) ?? []) {
      let come = 0;
      for (const [label, outcome] of join.conditions) {
        const child = own(states, `${path}/${label}`);
        const isThere = since !== null && child?.since == null && (child?.left ?? -1) >= since;
        const arrived = isThere && child?.outcome === outcome;
        if (arrived) come += 1;
        lines.get(label + SEP + outcome)?.classList.toggle("arrived", arrived);
      }
      if (text) write(text, joinText(join, come));
    }
  }

  /** Show the tokens of a plan and, beside a waiting transition, why it does not fire. */
  paintNet(path: string, state: StateRun | undefined) {
    const plan = this.states.get(path)?.node;
    if (plan?.kind !== "plan") return;
    const tokensOf = tokensIn(plan, state);
    for (const child of plan.children) {
      const view = this.states.get(child.path);
      if (!view || !isPartOfNet(child)) continue;
      const isTransition = child.kind === "transition";
      const tokens = isTransition ? 0 : tokensOf(child.label);
      const held = isTransition ? own(state?.held, child.label) : undefined;
      const isFired = isTransition && state?.since != null && state.fired === child.label;
      view.group.classList.toggle("marked", tokens > 0);
      view.group.classList.toggle("waiting", held !== undefined);
      view.group.classList.toggle("fired", isFired);
      write(view.badge, held ?? (tokens > 3 ? `\u25cf${tokens}` : "\u25cf".repeat(tokens)));
      const lacks = isTransition && held === undefined ? lackOf(plan, child, tokensOf) : "";
      const facts = [held, lacks, tokens ? `${tokens} token${tokens > 1 ? "s" : ""}` : "", isFired ? "fired" : ""];
      const label = [child.name, KIND_NAMES[child.kind], ...facts].filter(Boolean).join(", ");
      if (view.label === label) continue;
      view.label = label;
      view.group.setAttribute("aria-label", label);
      this.minimapDue.set(child.path, tokens > 0);
    }
  }

  /** Flash the arrows along which tokens have just moved. */
  flashFired(path: string, fired: string, now: number) {
    const transition = `${path}/${fired}`;
    const arrows = [...this.arrows.values()].flat();
    for (const { line, edge } of arrows)
      if (edge.source === transition || (edge.link?.target === fired && containerOf(edge.source) === path)) {
        line.classList.add("taken");
        this.flashing.set(line, now + FLASH_MS);
      }
  }

  /** Update the minimap; a few times a second, as doing it at every event costs as much as the rest. */
  paintMinimap() {
    for (const [path, active] of this.minimapDue) this.minimapRects.get(path)?.classList.toggle("active", active);
    this.minimapDue.clear();
  }

  /** Update the clock of a running state. */
  updateBadge(path: string, state: StateRun, now: number) {
    const view = this.states.get(path);
    if (view && state.since != null) write(view.badge, elapsed(view.node, state, now));
  }

  /** Flash a transition that was just taken. */
  flash(path: string, outcome: string, now: number) {
    for (const { line } of this.arrows.get(path + SEP + outcome) ?? []) {
      line.classList.add("taken");
      this.flashing.set(line, now + FLASH_MS);
    }
  }

  /** End the flashes whose time is over; returns whether any is left. */
  endFlashes(now: number) {
    for (const [line, until] of this.flashing)
      if (until < now) {
        line.classList.remove("taken");
        this.flashing.delete(line);
      }
    return this.flashing.size > 0;
  }

  /** Highlight the transitions that led to the end of a run. */
  showWay(ends: { path: string; outcome: string }[]) {
    this.mark(
      ends.map((one) => one.path),
      "on-way",
    );
    for (const { path, outcome } of ends) {
      for (const { line } of this.arrows.get(path + SEP + outcome) ?? []) line.classList.add("on-way");
      this.pills.get(path + SEP + outcome)?.classList.add("on-way");
    }
  }

  /** Give these states a class, and remove it from all others. */
  mark(paths: string[], name: string) {
    for (const group of this.world.querySelectorAll(`.${name}`)) group.classList.remove(name);
    for (const path of paths) this.states.get(path)?.group.classList.add(name);
  }

  /** Show numbers on transitions and heat on states. */
  showNumbers(countOf: CountOf | null, heatOf: HeatOf | null) {
    this.svg.classList.toggle("heated", Boolean(countOf));
    for (const { line, edge, count: text, note } of new Set([...this.arrows.values()].flat())) {
      const found = edge.outcomes.map((outcome) => countOf?.(edge.source, outcome) ?? { count: 0, share: 0 });
      const count = found.reduce((sum, one) => sum + one.count, 0);
      const share = found.reduce((sum, one) => sum + one.share, 0);
      line.style.strokeWidth = count ? `${Math.min(4, 1.2 + Math.log2(1 + count) * 0.6)}px` : "";
      line.classList.toggle("never", Boolean(countOf) && !count);
      const percent = share && share < 0.995 ? ` ${Math.round(share * 100)}%` : "";
      if (text) text.textContent = count ? `\u00d7${count}${percent}` : note;
    }
    for (const [path, { frame, group }] of this.states) {
      if (group.classList.contains("box")) continue;
      const heat = Math.round((heatOf?.(path) ?? 0) * 100);
      frame.style.fill = heat ? `color-mix(in srgb, var(--failure-fill) ${heat}%, var(--inactive-fill))` : "";
    }
  }
}

/** The beginning of a text that fits into a width. */
function fitting(text: string, width: number) {
  let short = text;
  while (short.length > 1 && measure(short, 10) > width) short = `${short.slice(0, -2)}\u2026`;
  return short;
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

/** The number of tokens in each place of a plan; an exec place has 1 while its action runs. */
function tokensIn(plan: StateNode, state: StateRun | undefined) {
  const counts: Map<string, number> = new Map();
  if (state?.marking) for (const place of state.marking) counts.set(place, (counts.get(place) ?? 0) + 1);
  else for (const child of plan.children) counts.set(child.label, child.tokens ?? 0);
  return (label: string) => counts.get(label) ?? 0;
}

/** The places in which a transition lacks tokens, as text; "" for none. */
function lackOf(plan: StateNode, transition: StateNode, tokensOf: (label: string) => number) {
  const inputs = plan.links.filter((link) => link.target === transition.label).map((link) => link.source);
  const empty = plan.children.filter((child) => inputs.includes(child.label) && !tokensOf(child.label));
  const places = empty.filter(isPartOfNet).map((child) => child.name);
  return places.length ? `lacks tokens in ${places.join(", ")}` : "";
}

function groupByPath(problems: Problem[]) {
  const found: Map<string, Problem[]> = new Map();
  for (const one of problems) found.set(one.path, [...(found.get(one.path) ?? []), one]);
  return found;
}

function glyphOf(state: StateRun | undefined, kind: OutcomeClass | null) {
  if (state?.waits) return "\u23f8";
  if (state?.since != null) return state.preempt ? (state.serviced ? "\u2713" : "\u25a0") : "";
  if (!kind) return "";
  if (state?.error) return "\u26a0";
  return { success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "" }[kind];
}

function statusOf(state: StateRun | undefined, goal: GoalRun | null | undefined, noServer: boolean) {
  if (state?.since == null) return state?.outcome ?? "not visited";
  if (state.preempt) return `asked to stop${state.serviced ? ", cleaning up" : ""}`;
  return noServer && goal ? `no server of ${goal.action} seen` : "running";
}

function write(shown: TextOf, text: string) {
  if (shown.text === text) return;
  shown.text = text;
  shown.element.textContent = text;
}

/** The text of a running state's badge: its time, attempt and so on. */
function elapsed(node: StateNode, state: StateRun, now: number) {
  const since = (ns: number | null | undefined) => Math.max(0, now - (ms(ns) ?? now)) / 1000;
  const attempt = state.attempt ?? 1;
  const tidies = isInCleanup(node);
  if (since(state.since) * 1000 < BRIEF_MS && !state.preempt && attempt < 2) return "";
  const parts = [];
  if (tidies) parts.push("tidying up");
  if (state.item != null) parts.push(`#${state.item + 1}`);
  if (attempt > 1) parts.push(`attempt ${attempt}`);
  if (!state.preempt) parts.push(duration(since(state.since)));
  else if (state.serviced) parts.push(`cleans up ${duration(since(state.serviced))}`);
  else {
    const grace = state.asked?.grace;
    parts.push(`asked to stop ${duration(since(state.preempt))}${grace != null ? ` of ${duration(grace)}` : ""}`);
  }
  return parts.join(" \u00b7 ");
}
