// Several live runs together: a card and a lane for each, and a common map.
import { useEffect, useRef, useState } from "preact/hooks";
import { askFleet, openRun } from "#core/connection.js";
import { lanesOf, nameOfRow, sceneOf } from "#core/fleet.js";
import * as store from "#core/store.js";
import { duration, shorten } from "#core/text.js";
import { MapView } from "#drawing/map.js";
import { isDark } from "#drawing/theme.js";
import { html } from "#panels/html.js";

const REFRESH_MS = 1000;

export const FleetPage = () => (store.fleetOpen.value ? html`<${OpenFleet} />` : null);

function OpenFleet() {
  const [rows, setRows] = useState(/** @type {FleetRow[]} */ ([]));
  const heading = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    heading.current?.focus();
    let open = true;
    const read = async () => {
      const found = await askFleet();
      if (found && open) setRows(found);
    };
    read();
    const timer = setInterval(read, REFRESH_MS);
    return () => {
      open = false;
      clearInterval(timer);
    };
  }, []);
  const close = () => {
    store.fleetOpen.value = false;
  };
  const show = (/** @type {string} */ id) => {
    close();
    openRun(id);
  };
  const { scene, now } = sceneOf(rows);
  const { seconds, lanes } = lanesOf(rows, now);
  return html`<section class="fleet" aria-labelledby="fleet-title">
    <header><h2 id="fleet-title" tabindex="-1" ref=${heading}>Fleet</h2>
      <span class="hint">${rows.length} live runs</span><span class="spread"></span>
      <button onClick=${close}>Close</button></header>
    <div class="fleet-top">
      <div class="cards">${rows.map(
        (row) => html`<button key=${row.id} onClick=${() => show(row.id)}>
        <b>${shorten(nameOfRow(row), 26)}</b>
        <span class=${`pill-text ${row.asks ? "waiting" : "active"}`}>${
          row.asks
            ? "? asks you"
            : `\u25cf ${shorten(row.strip.findLast((one) => one[3] === null)?.[1] ?? "running", 20)}`
        }</span>
        <small title=${row.reason}>${shorten(row.machine, 20)}: ${shorten(row.reason, 60)}</small></button>`,
      )}</div>
      ${!scene.isEmpty && html`<div class="fleet-map"><${FleetMap} scene=${scene} now=${now} /></div>`}
    </div>
    <div class="lanes" role="list" aria-label=${`the last ${duration(seconds)}`}>${lanes.map(
      (lane) =>
        html`<span title=${lane.name}>${shorten(lane.name, 24)}</span><${Lane} lane=${lane} seconds=${seconds} />`,
    )}</div>
  </section>`;
}

/** @param {{ scene: import("#core/scene.js").Scene, now: number }} props */
function FleetMap(props) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const view = useRef(/** @type {MapView | null} */ (null));
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
  return html`<canvas ref=${canvas} tabindex="0" role="img"></canvas>`;
}

/** @param {{ lane: ReturnType<typeof lanesOf>["lanes"][0], seconds: number }} props */
function Lane({ lane, seconds }) {
  const percent = (/** @type {number} */ s) => `${(100 * s) / seconds}%`;
  return html`<svg class="run-strip" height="20" role="listitem"
    aria-label=${`${lane.name}: ${lane.bars.map((bar) => bar.name).join(", ")}`}>${lane.bars.map(
      ({ name, kind, from, to }) => html`<rect class=${kind} x=${percent(from)} y="1" height="18" rx="3"
        width=${percent(Math.max(to - from, 0.004 * seconds))}><title>${name}: ${duration(to - from)}</title></rect>`,
    )}</svg>`;
}
