// The map beside the diagram, shown if the pose of any robot is known, with the facts of the visit at the pointer.

import type { ComponentChildren } from "preact";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { MapView } from "#drawing/map.ts";
import type { Page } from "#drawing/page.ts";

const NO_MAP = "No map: a grid of 1 m. Name a file with --map, or publish the topic map.";
const MOST_ROBOTS = 2; // with a button each; more do not fit into a line

export function MapPanel({ page, children }: { page: Page; children?: ComponentChildren }) {
  store.playback.watch();
  const { map } = page;
  const names = [...store.data.scene.robots]
    .filter(([, robot]) => robot.poses.length)
    .map(([name]) => name)
    .sort();
  const noMap = !store.data.scene.maps.length;
  return (
    <section class="map-panel" aria-label="map">
      <header>
        <h2>Map</h2>
        {noMap && (
          <span class="hint" title={NO_MAP}>
            No map: try --map FILE
          </span>
        )}
        <span class="spread" />
        <Choice map={map} names={names} />
      </header>
      <div class="map-view">
        {children}
        <Tip />
      </div>
    </section>
  );
}

/** Chooses between the whole map and one robot. */
function Choice({ map, names }: { map: MapView; names: string[] }) {
  if (names.length > MOST_ROBOTS)
    return (
      <select
        class="small"
        aria-label="robot in the middle"
        value={map.followed === null ? -1 : names.indexOf(map.followed)}
        onChange={(e) => map.show(names[Number(e.currentTarget.value)] ?? null)}
      >
        <option value={-1}>Whole</option>
        {names.map((name, i) => (
          <option value={i}>{shorten(name || "Robot", 40)}</option>
        ))}
      </select>
    );
  return (
    <span class="group">
      <button
        class={map.followed === null ? "on small" : "small"}
        title="the whole map (double-click)"
        onClick={() => map.show(null)}
      >
        Whole
      </button>
      {names.map((name) => (
        <button
          class={map.followed === name ? "on small" : "small"}
          title="keep it in the middle"
          onClick={() => map.show(name)}
        >
          {shorten(name || "Robot", 16)}
        </button>
      ))}
    </span>
  );
}

/** The visit that the pointer is on: state, place, outcome and times. */
function Tip() {
  const visit = store.pointer.hovered.value;
  if (!visit) return null;
  const goal = store.data.scene.goalOf(visit.path, visit.from);
  const span = store.data.run.spans.findLast((one) => one.path === visit.path && one.from === visit.from);
  const to = span?.to ?? null;
  const place = goal ? store.data.scene.placeName(goal) : "";
  const times = [visit.from, to].map((t) => (t === null ? "now" : store.clock.instantText(t))).join(" \u2013 ");
  const took = ((to ?? store.playback.nowMs()) - visit.from) / 1000;
  const title = store.data.nameOf(visit.path) + (place && ` \u2192 ${shorten(place, 30)}`);
  return (
    <div class="tip" role="status">
      <b>{title}</b>
      <span>
        {span?.outcome ? shorten(span.outcome, 30) : "runs"} {times}, {took.toFixed(1)} s
      </span>
    </div>
  );
}
