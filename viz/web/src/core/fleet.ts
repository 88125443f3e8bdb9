// Several live runs together: their lanes on one axis of time, and one scene for the common map.

import { Scene } from "#core/scene.ts";
import type { FleetRow, FleetRuns, RunRow } from "#core/types.ts";

/** The name of a run among others of its machine. */
export const nameOfRow = (row: RunRow) => (row.robots.length === 1 ? row.robots[0] : (row.name ?? row.machine));

/** How many runs there are, and which of them the viewer has sent. */
export function countText({ rows, skip, total }: FleetRuns) {
  const which = rows.length < total ? `${skip + 1} to ${skip + rows.length} of ` : "";
  return `${which}${total.toLocaleString("en")} live ${total === 1 ? "run" : "runs"}`;
}

/**
 * The states of each run as bars, on an axis that begins with the first run [s after that].
 * @param now of the robots [ms]; 0 if there are none
 */
export function lanesOf(rows: FleetRow[], now: number) {
  const begins = rows.flatMap((row) => (row.began === null ? [] : [row.began / 1e9]));
  const first = begins.length ? Math.min(...begins) : now / 1000;
  const ends = rows.flatMap((row) => (row.last === null ? [] : [row.last / 1e9]));
  const seconds = Math.max(1, Math.max(now / 1000, ...ends) - first);
  return {
    seconds,
    lanes: rows.map((row) => ({
      id: row.id,
      name: nameOfRow(row),
      bars: row.strip.map(([, name, from, to, kind]) => {
        const after = (row.began ?? 0) / 1e9 - first;
        return { name, kind, from: after + from, to: to === null ? seconds : after + to };
      }),
    })),
  };
}

/**
 * One scene of all robots. A robot without a name gets that of its run; if two runs drive a robot, they share a track.
 */
export function sceneOf(rows: FleetRow[]) {
  const scene = new Scene();
  let now = 0;
  for (const row of rows) {
    const called = row.name ?? row.machine;
    scene.addEvents(
      row.events.map((e) =>
        "action" in e && /^\/?[^/]*$/.test(e.action) ? { ...e, action: `${called}/${e.action}` } : e,
      ),
    );
    scene.addObserved(row.observed.map((one) => (one.robot || one.what === "map" ? one : { ...one, robot: called })));
    for (const { stamp_ns } of [...row.events, ...row.observed]) now = Math.max(now, stamp_ns / 1e6);
  }
  return { scene, now };
}
