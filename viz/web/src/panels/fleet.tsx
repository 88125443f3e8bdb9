// Several live runs together: a card and a lane for each, and a common map.

import { useEffect, useRef, useState } from "preact/hooks";
import { countText, lanesOf, nameOfRow, sceneOf } from "#core/fleet.ts";
import { showPage } from "#core/pages.ts";
import { askFleet, openRun } from "#core/run_requests.ts";
import type { Scene } from "#core/scene.ts";
import { store } from "#core/store.ts";
import { duration, shorten } from "#core/text.ts";
import type { FleetRuns } from "#core/types.ts";
import { MapView } from "#drawing/map.ts";
import { isDark } from "#drawing/theme.ts";

const REFRESH_MS = 1000;
const GAP = 8;
const MOST_COLUMNS = 4; // an answer has 32 runs: 7 lines are in view, or next to it
const CARD = { width: 200 + GAP, height: 88 + GAP }; // [px]; see `.cards button`

export const FleetPage = () => (store.view.pageShown.value === "fleet" ? <OpenFleet /> : null);

function OpenFleet() {
  const [skip, setSkip] = useState(0);
  const [found, setFound] = useState<FleetRuns | null>(null); // null: not answered yet
  const [width, setWidth] = useState(0); // of the cards [px]
  const heading = useRef<HTMLHeadingElement | null>(null);
  const box = useRef<HTMLDivElement | null>(null);
  useEffect(() => heading.current?.focus(), []);
  useEffect(() => {
    const seen = new ResizeObserver(() => setWidth(box.current?.clientWidth ?? 0));
    if (box.current) seen.observe(box.current);
    return () => seen.disconnect();
  }, []);
  useEffect(() => {
    let open = true;
    const read = async () => {
      const answer = await askFleet(skip);
      if (answer && open) setFound(answer);
    };
    read();
    const timer = setInterval(read, REFRESH_MS);
    return () => {
      open = false;
      clearInterval(timer);
    };
  }, [skip]);
  const { rows, total, skip: before } = found ?? { rows: [], total: 0, skip: 0 };
  const { scene, now } = sceneOf(rows);
  const { seconds, lanes } = lanesOf(rows, now);
  const columns = Math.min(MOST_COLUMNS, Math.max(1, Math.floor((width + GAP) / CARD.width)));
  const line = Math.floor(before / columns);
  // A line before those in view is there, too, so that none is empty while the next answer comes.
  const onScroll = (e: Event) => {
    const above = Math.floor((e.target as HTMLElement).scrollTop / CARD.height) - 1;
    setSkip(Math.max(0, above * columns));
  };
  return (
    <section class="fleet" aria-labelledby="fleet-title">
      <header>
        <h2 id="fleet-title" tabindex={-1} ref={heading}>
          Fleet
        </h2>
        <span class="hint">{found ? countText(found) : "reading the runs\u2026"}</span>
        <span class="spread" />
        <button onClick={() => showPage("runs")}>Close</button>
      </header>
      {found && !total && <p class="empty-list">No mission runs now. Each one that begins gets a card here.</p>}
      <div class={found && scene.isEmpty ? "fleet-top without-map" : "fleet-top"}>
        <div class="cards" ref={box} onScroll={onScroll}>
          <div style={{ height: `${Math.ceil(total / columns) * CARD.height}px` }}>
            <div class="in-view" style={{ transform: `translateY(${line * CARD.height}px)`, "--columns": columns }}>
              {rows.map((row) => (
                <button key={row.id} onClick={() => openRun(row.id)}>
                  <b>{shorten(nameOfRow(row), 26)}</b>
                  <span class={`pill-text ${row.asks ? "waiting" : "active"}`}>
                    {row.asks
                      ? "? asks you"
                      : `\u25cf ${shorten(row.strip.findLast((one) => one[3] === null)?.[1] ?? "running", 20)}`}
                  </span>
                  <small title={row.reason}>
                    {shorten(row.machine, 20)}: {shorten(row.reason, 60)}
                  </small>
                </button>
              ))}
            </div>
          </div>
        </div>
        {!scene.isEmpty && (
          <div class="fleet-map">
            <FleetMap scene={scene} now={now} />
          </div>
        )}
      </div>
      <div class="lanes" role="list" aria-label={`the last ${duration(seconds)}`}>
        {lanes.map((lane) => (
          <>
            <span title={lane.name}>{shorten(lane.name, 24)}</span>
            <Lane lane={lane} seconds={seconds} />
          </>
        ))}
      </div>
    </section>
  );
}

function FleetMap(props: { scene: Scene; now: number }) {
  const canvas = useRef<HTMLCanvasElement | null>(null);
  const view = useRef<MapView | null>(null);
  const dark = isDark();
  useEffect(() => {
    if (canvas.current && !view.current) view.current = new MapView(canvas.current);
    if (!view.current) return;
    view.current.given = props;
    view.current.draw();
  });
  useEffect(() => {
    view.current?.restyle();
    view.current?.draw();
  }, [dark]);
  return <canvas ref={canvas} tabindex={0} role="img" />;
}

function Lane({ lane, seconds }: { lane: ReturnType<typeof lanesOf>["lanes"][0]; seconds: number }) {
  const percent = (s: number) => `${(100 * s) / seconds}%`;
  return (
    <svg
      class="run-strip"
      height="20"
      role="listitem"
      aria-label={`${lane.name}: ${lane.bars.map((bar) => bar.name).join(", ")}`}
    >
      {lane.bars.map(({ name, kind, from, to }) => (
        <rect
          class={kind}
          x={percent(from)}
          y="1"
          height="18"
          rx="3"
          width={percent(Math.max(to - from, 0.004 * seconds))}
        >
          <title>
            {name}: {duration(to - from)}
          </title>
        </rect>
      ))}
    </svg>
  );
}
