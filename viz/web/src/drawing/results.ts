// What ELK answers, in the page's types.

import type { ElkNode, ElkPort } from "elkjs/lib/elk-api.d.ts";
import type { Box } from "#core/types.ts";
import type { ContainerLayout, EdgeMeaning } from "#drawing/placed.ts";
import type { Graph, Plan } from "#drawing/plan.ts";

/** ELK's result in the page's types. */
export function placed(plan: Plan, found: Graph): ContainerLayout {
  const result: ContainerLayout = {
    node: plan.node,
    shape: plan.shape,
    w: found.width ?? 0,
    h: found.height ?? 0,
    boxes: [],
    pills: [],
    joins: [],
    ports: [],
    edges: [],
    entry: null,
  };
  for (const port of found.ports ?? []) {
    const meaning = plan.meanings.get(port.id);
    const place = boxOf(port);
    const outcome = meaning?.kind === "pill" ? meaning.outcome : "";
    result.ports.push({ ...place, entry: meaning?.kind === "entry", outcome });
    if (meaning?.kind === "entry") result.entry = { x: place.x + 5, y: place.y + 5 };
    else result.pills.push({ ...place, outcome, from: meaning?.kind === "pill" ? meaning.from : undefined });
  }
  for (const child of found.children) {
    const meaning = plan.meanings.get(child.id);
    const place = boxOf(child);
    if (meaning?.kind === "entry") result.entry = { x: place.x + 4.5, y: place.y + 4.5 };
    else if (meaning?.kind === "join") result.joins.push({ ...place, join: meaning.join });
    else if (meaning?.kind === "pill") result.pills.push({ ...place, outcome: meaning.outcome, from: meaning.from });
    else if (meaning?.kind === "open") {
      const { child: node, inner } = meaning;
      result.boxes.push({ ...place, node, inner, hasRows: false, nameWidth: 0, dots: [] });
    } else if (meaning?.kind === "leaf") {
      const { child: node, hasRows, nameWidth } = meaning;
      result.boxes.push({ ...place, node, inner: null, hasRows, nameWidth, dots: hasRows ? dotsOf(child, plan) : [] });
    }
  }
  for (const edge of found.edges) {
    const meaning = plan.meanings.get(edge.id) as EdgeMeaning | { kind: "hidden" };
    if (meaning.kind === "hidden") continue;
    for (const section of edge.sections ?? [])
      result.edges.push({
        ...meaning,
        points: [section.startPoint, ...(section.bendPoints ?? []), section.endPoint],
        labels: (edge.labels ?? []).map(({ x = 0, y = 0, width = 0, text = "" }) => ({ x: x + width / 2, y, text })),
      });
  }
  return result;
}

const boxOf = ({ x = 0, y = 0, width: w = 0, height: h = 0 }: ElkNode | ElkPort): Box => ({ x, y, w, h });

const dotsOf = (child: ElkNode, plan: Plan) =>
  (child.ports ?? []).flatMap((port) => {
    const { x, y } = boxOf(port);
    const meaning = plan.meanings.get(port.id);
    return meaning?.kind === "dot" ? [{ x: x + 3.5, y: y + 3.5, outcome: meaning.outcome }] : [];
  });

/**
 * Whether all arrows are made of level and upright lines: when ELK folds a container, it can lose parts of an arrow
 * that goes over several lines.
 */
export const isSound = ({ edges }: ContainerLayout) =>
  edges.every(({ points }) =>
    points.every(
      ({ x, y }, i) => i === 0 || Math.min(Math.abs(x - points[i - 1].x), Math.abs(y - points[i - 1].y)) < 1,
    ),
  );
