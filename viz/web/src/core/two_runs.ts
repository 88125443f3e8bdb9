// Two runs one under the other on a common time: a recorded one, and today's.

import type { Model } from "#core/model.ts";
import { endClass } from "#core/outcomes.ts";
import type { Run } from "#core/run.ts";
import type { RunEvent, Span } from "#core/types.ts";
import type { RunDifference } from "#core/wire.ts";

/** Times on the common axis [s]; `at` of the visit itself on its own run's clock [ms]. */
export type Bar = { path: string; name: string; from: number; to: number; at: number; kind: string; differs: boolean };
export type Lane = { path: string; name: string; bars: Bar[] };
export type TwoRuns = { names: [string, string][]; recorded: Lane[]; now: Lane[]; from: number; to: number };

const BEFORE_S = 30; // of the difference that are shown at first
const AFTER_S = 60;
const NEAR_S = 0.002; // times are rounded on their way

/** The instant at which a run began [ms]. */
export function beginOf(run: Run): number {
  const started = run.events.find((e: RunEvent) => e.kind === "Started");
  return started ? started.stamp_ns / 1e6 : (run.first() ?? 0);
}

/**
 * The lanes of both runs. In lanes of one name the same branch or container runs.
 * @param aligned whether 0 is the first difference in both; else it is the begin of each
 */
export function twoRuns(
  { recorded, now, model }: { recorded: Run; now: Run; model: Model },
  difference: RunDifference | null,
  aligned: boolean,
): TwoRuns {
  const at = difference?.at ?? 0;
  const zero = aligned ? at : 0;
  const sides = [
    { run: recorded, zero, differs: at },
    { run: now, zero: zero + (aligned ? (difference?.later ?? 0) : 0), differs: at + (difference?.later ?? 0) },
  ].map((side) => lanesOf(side, model, difference?.path ?? null));
  const order = new Map(model.order.map(({ path }, i) => [path, i]));
  const paths = [...new Set(sides.flatMap((lanes) => [...lanes.keys()]))];
  paths.sort((a, b) => (order.get(a) ?? Infinity) - (order.get(b) ?? Infinity));
  const nameOf = (path: string) => model.get(path)?.name ?? path.slice(path.lastIndexOf("/") + 1);
  const [old, today] = sides.map((lanes) =>
    paths.map((path) => ({ path, name: nameOf(path), bars: lanes.get(path) ?? [] })),
  );
  const bars = [...old, ...today].flatMap((lane) => lane.bars);
  return {
    names: paths.map((path) => [path, nameOf(path)]),
    recorded: old,
    now: today,
    from: Math.min(0, ...bars.map((bar) => bar.from)),
    to: Math.max(1, ...bars.map((bar) => bar.to)),
  };
}

/** The range of the common axis that shows the first difference and what is around it. */
export function around({ from, to }: { from: number; to: number }, zero: number) {
  return { from: Math.max(from, zero - BEFORE_S), to: Math.min(to, zero + AFTER_S) };
}

function lanesOf(
  { run, zero, differs }: { run: Run; zero: number; differs: number },
  model: Model,
  path: string | null,
) {
  const began = beginOf(run);
  const last = run.last() ?? began;
  const seconds = (t: number) => (t - began) / 1000 - zero;
  const different = path === null ? null : visitAt(run.spans, path, began + 1000 * (differs + NEAR_S));
  const lanes = new Map<string, Bar[]>();
  for (const span of run.spans) {
    const above = span.path.slice(0, span.path.lastIndexOf("/"));
    if (!above) continue; // the machine itself
    const isBranch = model.get(above)?.kind === "concurrence";
    const lane = isBranch ? span.path : above;
    const bars = lanes.get(lane) ?? [];
    lanes.set(lane, bars);
    const node = model.get(span.path);
    bars.push({
      path: span.path,
      name: node?.name ?? span.path.slice(above.length + 1),
      from: seconds(span.from),
      to: seconds(span.to ?? last),
      at: span.from,
      kind: span.to === null ? "active" : endClass(node, span.outcome),
      differs: span === different,
    });
  }
  return lanes;
}

const visitAt = (spans: Span[], path: string, t: number) =>
  spans.findLast((one) => one.path === path && one.from <= t) ?? null;
