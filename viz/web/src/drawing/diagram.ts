// The diagram: SVG elements are built once per layout; events only change their classes and texts.

import { containerOf, own } from "#core/fold.ts";
import type { Model } from "#core/model.ts";
import { isPartOfNet, joinText, KIND_NAMES } from "#core/model.ts";
import { endClass } from "#core/outcomes.ts";
import type { CountOf, HeatOf } from "#core/statistics.ts";
import type { Box, GoalRun, Problem, StateRun } from "#core/types.ts";
import { fitting } from "#drawing/measure.ts";
import { Picture, type TextOf } from "#drawing/picture.ts";
import { type ContainerLayout, SEP } from "#drawing/placed.ts";
import { elapsed, glyphOf, lackOf, statusOf, tokensIn } from "#drawing/state_texts.ts";
import { arrowHeads, el } from "#drawing/svg.ts";

const FLASH_MS = 380;
const FADE_MS = 5000;
const CLASSES = ["success", "failure", "preempted", "other"];
const CARD_TEXT = 118; // room for a text in a card

export class Diagram {
  svg: SVGSVGElement;
  world: SVGElement;
  picture = new Picture();
  onActive: (path: string, active: boolean) => void;
  flashing: Map<SVGElement, number> = new Map(); // end of the flash of each element [ms]

  /** @param onActive called when a state may have begun or ended to run */
  constructor(svg: SVGSVGElement, onActive: (path: string, active: boolean) => void) {
    this.svg = svg;
    this.onActive = onActive;
    this.world = el("g", { class: "world" });
    svg.replaceChildren(arrowHeads(), this.world);
  }

  draw(layout: ContainerLayout, model: Model, problems: Problem[]) {
    const isCompared = model.order.some((n) => n.change || n.note || n.edges.some((e) => e.change || e.note));
    this.svg.classList.toggle("compared", isCompared);
    this.picture = new Picture();
    this.world.replaceChildren(this.picture.build(layout, model, problems));
  }

  /** The box around the machine; null before it is drawn. */
  get size() {
    return this.picture.size;
  }

  boxOf(path: string | null): Box | undefined {
    return path === null ? undefined : this.picture.boxes.get(path);
  }

  /** Adapt titles and details to a scale. */
  showScale(k: number) {
    this.svg.classList.toggle("far", k < 0.6);
    this.svg.classList.toggle("farther", k < 0.35);
    this.svg.style.setProperty("--title", `${Math.max(11, Math.min(11 / k, 44)).toFixed(1)}px`);
  }

  /** Write into the cards what they say now. */
  paintCards(textOf: (path: string) => string) {
    for (const [path, card] of this.picture.cards) write(card, fitting(textOf(path), CARD_TEXT));
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
    const view = this.picture.states.get(path);
    if (!view || isPartOfNet(view.node)) return;
    const isBlank = !state && !goal;
    if (isBlank && view.isBlank) return;
    view.isBlank = isBlank;
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
    this.onActive(path, active);
  }

  /** Show at the joins of a container how many conditions were met in its visit. */
  paintJoins(path: string, states: Record<string, StateRun>) {
    const since = own(states, path)?.since ?? null;
    for (const { join, text, lines } of this.picture.joins.get(path) ?? []) {
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
    const plan = this.picture.states.get(path)?.node;
    if (plan?.kind !== "plan") return;
    const tokensOf = tokensIn(plan, state);
    for (const child of plan.children) {
      const view = this.picture.states.get(child.path);
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
      this.onActive(child.path, tokens > 0);
    }
  }

  /** Flash the arrows along which tokens have just moved. */
  flashFired(path: string, fired: string, now: number) {
    const transition = `${path}/${fired}`;
    const arrows = [...this.picture.arrows.values()].flat();
    for (const { line, edge } of arrows)
      if (edge.source === transition || (edge.link?.target === fired && containerOf(edge.source) === path)) {
        line.classList.add("taken");
        this.flashing.set(line, now + FLASH_MS);
      }
  }

  /** Update the clock of a running state. */
  updateBadge(path: string, state: StateRun, now: number) {
    const view = this.picture.states.get(path);
    if (view && state.since != null) write(view.badge, elapsed(view.node, state, now));
  }

  /** Flash a transition that was just taken. */
  flash(path: string, outcome: string, now: number) {
    for (const { line } of this.picture.arrows.get(path + SEP + outcome) ?? []) {
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
      for (const { line } of this.picture.arrows.get(path + SEP + outcome) ?? []) line.classList.add("on-way");
      this.picture.pills.get(path + SEP + outcome)?.classList.add("on-way");
    }
  }

  /** Give these states a class, and remove it from all others. */
  mark(paths: string[], name: string) {
    for (const group of this.world.querySelectorAll(`.${name}`)) group.classList.remove(name);
    for (const path of paths) this.picture.states.get(path)?.group.classList.add(name);
  }

  /** Show numbers on transitions and heat on states. */
  showNumbers(countOf: CountOf | null, heatOf: HeatOf | null) {
    this.svg.classList.toggle("heated", Boolean(countOf));
    for (const { line, edge, count: text, note } of new Set([...this.picture.arrows.values()].flat())) {
      const found = edge.outcomes.map((outcome) => countOf?.(edge.source, outcome) ?? { count: 0, share: 0 });
      const count = found.reduce((sum, one) => sum + one.count, 0);
      const share = found.reduce((sum, one) => sum + one.share, 0);
      line.style.strokeWidth = count ? `${Math.min(4, 1.2 + Math.log2(1 + count) * 0.6)}px` : "";
      line.classList.toggle("never", Boolean(countOf) && !count);
      const percent = share && share < 0.995 ? ` ${Math.round(share * 100)}%` : "";
      if (text) text.textContent = count ? `\u00d7${count}${percent}` : note;
    }
    for (const [path, { frame, group }] of this.picture.states) {
      if (group.classList.contains("box")) continue;
      const heat = Math.round((heatOf?.(path) ?? 0) * 100);
      frame.style.fill = heat ? `color-mix(in srgb, var(--failure-fill) ${heat}%, var(--inactive-fill))` : "";
    }
  }
}

function write(shown: TextOf, text: string) {
  if (shown.text === text) return;
  shown.text = text;
  shown.element.textContent = text;
}
