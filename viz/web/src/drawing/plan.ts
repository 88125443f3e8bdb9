// One container as a graph for ELK, with the meaning of each id in it.

import type { ElkExtendedEdge, ElkNode } from "elkjs/lib/elk-api.d.ts";
import { joinText } from "#core/model.ts";
import { shorten } from "#core/text.ts";
import type { Direction, Join, Link, StateNode } from "#core/types.ts";
import { measure } from "#drawing/measure.ts";
import {
  type ContainerLayout,
  type EdgeMeaning,
  type Ends,
  LEAF_H,
  leafWidth,
  type Meaning,
  pillWidth,
  type Shape,
} from "#drawing/placed.ts";
import { bundlesOf, hasOver } from "#drawing/shapes.ts";

/** A container as ELK's JSON, with all its lists. */
export type Graph = ElkNode &
  Required<Pick<ElkNode, "children" | "ports" | "layoutOptions">> & { edges: ElkExtendedEdge[] };

const ROW_H = 14;
const PILL_H = 15;
const ENTRY = 10;
const BAR = 6; // thickness of a join
const DENSE = { links: 48, perState: 4 }; // arrows of a container from which straight ones take too long to find
const FLOW = {
  DOWN: { out: "SOUTH", in: "NORTH" },
  RIGHT: { out: "EAST", in: "WEST" },
};
const SPACING = {
  "elk.spacing.nodeNode": "18",
  "elk.spacing.edgeNode": "11",
  "elk.spacing.edgeEdge": "9",
  "elk.layered.spacing.edgeNodeBetweenLayers": "8",
  "elk.layered.spacing.edgeEdgeBetweenLayers": "7",
  "elk.spacing.edgeLabel": "3",
  "elk.spacing.portPort": "10",
  "elk.spacing.componentComponent": "22",
};

export class Plan {
  node: StateNode;
  shape: Shape;
  dir: Direction;
  outer: Direction | null;
  id: string;
  inner: Map<string, ContainerLayout>;
  hasRows: boolean;
  outcomes: string[];
  graph: Graph;
  entry: string;
  ends: Map<string, Ends>;
  targets: Map<string, string>;
  bars: string[];
  bundled: Map<Link, number>; // transitions without an arrow of their own, with the size of their bundle
  meanings: Map<string, Meaning> = new Map();
  #count = 0;

  /**
   * @param shape its own
   * @param outer direction of the container around it; null for the root
   * @param inner by label
   * @param aspect aspect of the view, for folding
   */
  constructor(
    node: StateNode,
    shape: Shape,
    outer: Direction | null,
    id: string,
    inner: Map<string, ContainerLayout>,
    aspect: number,
  ) {
    this.node = node;
    this.shape = shape;
    const { dir } = shape;
    this.dir = dir;
    this.outer = outer;
    this.id = id;
    this.inner = inner;
    this.hasRows = dir === "RIGHT"; // a row for each outcome
    this.bundled = bundlesOf(node);
    this.outcomes = this.#shownOutcomes();
    this.graph = this.#frame();
    if (shape.columns)
      Object.assign(this.graph.layoutOptions, {
        "elk.partitioning.activate": "true",
        "elk.layered.nodePlacement.strategy": "SIMPLE", // rows are placed below each other
        "elk.separateConnectedComponents": "false",
      });
    if (shape.folded)
      Object.assign(this.graph.layoutOptions, {
        "elk.layered.wrapping.strategy": "MULTI_EDGE",
        "elk.aspectRatio": String(aspect),
      });
    this.entry = this.#entry();
    this.ends = new Map(node.children.map((child) => [child.label, this.#child(child)]));
    this.targets = new Map(this.outcomes.map((outcome) => [outcome, this.#outcome(outcome)]));
    this.bars = node.joins.map((join) => this.#join(join));
    if (shape.columns) this.#makeRows(shape.columns);
    this.#edges();
  }

  #next(meaning: Meaning) {
    const id = `${this.id}.${this.#count++}`;
    this.meanings.set(id, meaning);
    return id;
  }

  #shownOutcomes() {
    const used = new Set(this.node.links.filter((link) => link.to_outcome).map((link) => link.target));
    if (this.outer !== null) {
      // the root shows only outcomes to which something leads
      for (const pill of this.node.pills) used.add(pill.outcome);
      for (const outcome of this.node.wired ?? []) used.add(outcome);
    }
    return this.node.outcomes.filter((outcome) => used.has(outcome));
  }

  #frame(): Graph {
    const { node, dir, outer } = this;
    const tag = { concurrence: 66, iterator: 52, sequence: 60 }[node.kind] ?? 8;
    const pill = Math.max(0, ...this.outcomes.map(pillWidth));
    const name = measure(node.shown, 11, true) + tag + 30;
    const title = outer === "DOWN" ? 2 * name - 20 : name; // beside the line that enters at the top
    const right = outer === "RIGHT" ? 14 + pill / 2 : 14;
    const bottom = outer === "DOWN" ? 20 : 14;
    return {
      id: this.id,
      children: [],
      edges: [],
      ports: [],
      labels: [{ text: node.shown, width: title, height: 17 }],
      layoutOptions: {
        ...SPACING,
        "elk.algorithm": "layered",
        "elk.direction": dir,
        "elk.edgeRouting": "ORTHOGONAL",
        "elk.hierarchyHandling": "SEPARATE_CHILDREN",
        "elk.padding": `[top=14,left=14,bottom=${bottom},right=${right}]`,
        "elk.layered.spacing.nodeNodeBetweenLayers": dir === "DOWN" ? "12" : "22",
        // The simplex method makes more arrows straight, but takes minutes if twelve states all lead to each other.
        "elk.layered.nodePlacement.strategy": hasOver(node, DENSE) ? "BRANDES_KOEPF" : "NETWORK_SIMPLEX",
        "elk.layered.nodePlacement.favorStraightEdges": "true",
        "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
        // A plan lists all places before all transitions: in that order half of its arcs would point back.
        "elk.layered.cycleBreaking.strategy": node.kind === "plan" ? "DEPTH_FIRST" : "MODEL_ORDER",
        "elk.layered.edgeLabels.sideSelection": "SMART_DOWN",
        "elk.nodeLabels.placement": "[H_CENTER, V_TOP, INSIDE]",
        "elk.nodeSize.constraints": "[NODE_LABELS, PORTS, PORT_LABELS, MINIMUM_SIZE]",
        "elk.portConstraints": "FIXED_SIDE",
      },
    };
  }

  #entry() {
    const id = this.#next({ kind: "entry" });
    if (this.outer === null)
      this.graph.children.push({
        id,
        width: 9,
        height: 9,
        layoutOptions: { "elk.layered.layering.layerConstraint": "FIRST" },
      });
    else
      this.graph.ports.push({
        id,
        width: ENTRY,
        height: ENTRY,
        layoutOptions: { "elk.port.side": FLOW[this.outer].in, "elk.port.borderOffset": String(-ENTRY / 2) },
      });
    return id;
  }

  #child(child: StateNode): Ends {
    const inner = this.inner.get(child.label);
    return inner ? this.#openChild(child, inner) : this.#leaf(child);
  }

  #openChild(child: StateNode, inner: ContainerLayout): Ends {
    const out = new Map<string, string>();
    const id = this.#next({ kind: "open", child, inner });
    let entry = id;
    const ports = inner.ports.map((p) => {
      const port = this.#next({ kind: "port" });
      if (p.entry) entry = port;
      else out.set(p.outcome, port);
      const offset = p.entry ? -ENTRY / 2 : this.dir === "DOWN" ? -p.h / 2 : -p.w / 2;
      const side = FLOW[this.dir][p.entry ? "in" : "out"];
      return {
        id: port,
        x: p.x,
        y: p.y,
        width: p.w,
        height: p.h,
        layoutOptions: { "elk.port.side": side, "elk.port.borderOffset": String(offset) },
      };
    });
    this.graph.children.push({
      id,
      width: inner.w,
      height: inner.h,
      ports,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" },
    });
    return { entry, out: (outcome) => out.get(outcome ?? "") ?? id, split: true };
  }

  #leaf(child: StateNode): Ends {
    const width = leafWidth(child);
    if (!this.hasRows || !child.wired.length) {
      const id = this.#next({ kind: "leaf", child, hasRows: false, nameWidth: 0 });
      this.graph.children.push({ id, width, height: LEAF_H });
      return { entry: id, out: () => id, split: false };
    }
    const text = Math.max(...child.wired.map((outcome) => measure(shorten(outcome), 9))) + 16;
    const single = child.wired.length === 1;
    const h = single ? LEAF_H : Math.max(LEAF_H, 10 + child.wired.length * ROW_H);
    const w = width - 4 + text;
    const id = this.#next({ kind: "leaf", child, hasRows: true, nameWidth: width });
    const top = (h - child.wired.length * ROW_H) / 2;
    const out = new Map<string, string>();
    const ports = child.wired.map((outcome, i) => {
      const port = this.#next({ kind: "dot", outcome });
      out.set(outcome, port);
      return {
        id: port,
        x: w - 3.5,
        y: single ? h / 2 - 3.5 : top + i * ROW_H + 3.5,
        width: 7,
        height: 7,
        layoutOptions: { "elk.port.side": "EAST", "elk.port.borderOffset": "-3.5" },
      };
    });
    this.graph.children.push({
      id,
      width: w,
      height: h,
      ports,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" },
    });
    return { entry: id, out: (outcome) => out.get(outcome ?? "") ?? id, split: true };
  }

  #outcome(outcome: string) {
    const from = [...this.bundled].find(([link]) => link.target === outcome)?.[1];
    const w = pillWidth(from ? `${outcome}, from ${from}` : outcome) + (this.outer === null ? 4 : 0);
    const id = this.#next({ kind: "pill", outcome, from });
    if (this.outer === null)
      this.graph.children.push({
        id,
        width: w,
        height: 18,
        layoutOptions: { "elk.layered.layering.layerConstraint": "LAST" },
      });
    else {
      const offset = this.outer === "DOWN" ? -PILL_H / 2 : -w / 2;
      this.graph.ports.push({
        id,
        width: w,
        height: PILL_H,
        layoutOptions: { "elk.port.side": FLOW[this.outer].out, "elk.port.borderOffset": String(offset) },
      });
    }
    return id;
  }

  /** Arrange children in rows, with entry above and joins and outcomes below. */
  #makeRows(columns: number) {
    const rows = Math.ceil(this.node.children.length / columns);
    let i = 0;
    for (const one of this.graph.children) {
      const kind = this.meanings.get(one.id)?.kind ?? "";
      const row = ({ entry: 0, join: rows + 1, pill: rows + 2 } as Record<string, number>)[kind];
      one.layoutOptions = {
        ...one.layoutOptions,
        "elk.partitioning.partition": String(row ?? 1 + Math.floor(i++ / columns)),
      };
    }
  }

  #join(join: Join) {
    const id = this.#next({ kind: "join", join });
    const long = 12 + 12 * join.conditions.length;
    const [width, height] = this.dir === "DOWN" ? [long, BAR] : [BAR, long];
    this.graph.children.push({ id, width, height });
    return id;
  }

  #edges() {
    const { node } = this;
    for (const label of node.initial) {
      const kind = node.kind === "concurrence" ? "fork" : "initial";
      const target = this.ends.get(label);
      // In a grid the tag says that all children begin at once; lines to all of them would hide the children.
      if (target && !this.shape.columns) this.#edge({ kind, source: "", outcomes: [] }, this.entry, target.entry);
    }
    for (const link of node.links) {
      if (this.bundled.has(link)) continue;
      const source = this.ends.get(link.source);
      const outcome = link.join === null ? this.targets.get(link.target) : this.bars[link.join];
      const target = link.to_outcome ? outcome : this.ends.get(link.target)?.entry;
      if (!source || !target) continue;
      const meaning = { kind: "link" as const, link, source: `${node.path}/${link.source}` };
      if (source.split)
        for (const outcome of link.outcomes)
          this.#edge({ ...meaning, outcomes: [outcome] }, source.out(outcome), target);
      else {
        const plain =
          link.to_outcome && link.join === null && link.outcomes.length === 1 && link.outcomes[0] === link.target;
        this.#edge({ ...meaning, outcomes: link.outcomes }, source.out(), target, plain ? [] : link.outcomes);
      }
    }
    for (const [i, join] of node.joins.entries()) {
      const target = this.targets.get(join.outcome);
      const meaning = { kind: "link" as const, join, source: node.path, outcomes: [join.outcome] };
      // wide enough for its longest text, while it waits
      if (target) this.#edge(meaning, this.bars[i], target, [joinText(join, join.need - 1)]);
    }
    if (this.bundled.size || (this.shape.folded && this.outer !== null)) this.#reachOutcomes();
  }

  /** Lead an invisible line to each port without one: ELK cannot fold a container with an unconnected port. */
  #reachOutcomes() {
    const reached = new Set(this.graph.edges.map((edge) => edge.targets[0]));
    const last = this.graph.children[this.graph.children.length - 1];
    for (const target of this.targets.values())
      if (!reached.has(target)) this.#edge({ kind: "hidden" }, last.id, target);
  }

  #edge(meaning: EdgeMeaning | { kind: "hidden" }, source: string, target: string, labels: string[] = []) {
    this.graph.edges.push({
      id: this.#next(meaning),
      sources: [source],
      targets: [target],
      labels: labels.map((text) => ({ text, width: measure(shorten(text), 9) + 6, height: 12 })),
    });
  }
}
