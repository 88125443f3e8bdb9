// The home page: a list of live and past runs, with filters and pins.
import { useEffect, useRef, useState } from "preact/hooks";
import { commandMission, hasToken, openRun, refreshRuns, showHome } from "#core/connection.js";
import {
  beganText,
  chosen,
  countsOf,
  filterText,
  outageText,
  pinOf,
  SHOWN,
  SHOWN_NAMES,
  secondsOf,
  standing,
  tally,
} from "#core/run_list.js";
import * as store from "#core/store.js";
import { duration, shorten } from "#core/text.js";
import { fieldValue, html, More } from "#panels/html.js";

const MOST_ROWS = 40; // at first
const MOST_NAMES = 8; // in a list of filters
/** @type {Record<string, string>} */
const SIGNS = {
  live: "\u25cf",
  success: "\u2713",
  failure: "\u2715",
  preempted: "\u2298",
  other: "\u00b7",
  cut: "\u2026",
  interrupted: "\u2016",
  queued: "\u2026",
};
/** @type {Record<string, string>} */
const WORDS = { live: "running", interrupted: "interrupted", queued: "queued" };
const REFRESH_MS = 5000; // changes in journals are found only by asking again
/** The others have the names of their colours. @type {Record<string, string>} */
const KINDS = { live: "active", cut: "waiting", interrupted: "waiting", queued: "waiting" };

export const HomePage = () => (store.homeOpen.value ? html`<${OpenHome} />` : null);

const openSimulations = () => {
  store.simulateOpen.value = true;
};

const lastWord = (/** @type {string} */ path) => path.split("/").at(-1) || path;

/** @type {import("#core/run_list.js").Filter} */
const ALL = { show: "all", machine: null, robot: null, text: "" };

function OpenHome() {
  const [filter, setFilter] = useState(ALL);
  const [most, setMost] = useState(MOST_ROWS);
  const heading = useRef(/** @type {HTMLElement | null} */ (null));
  const { machines } = store;
  useEffect(() => heading.current?.focus(), []);
  useEffect(() => {
    refreshRuns();
  }, [machines.value]);
  const { runs, folders, journals } = store.runs.value;
  useEffect(() => {
    if (!journals.length) return;
    const timer = setInterval(refreshRuns, REFRESH_MS);
    return () => clearInterval(timer);
  }, [journals.length > 0]);
  store.slowTick.value;
  const pins = store.pins.value;
  const rows = chosen(runs, filter, pins);
  const change = (/** @type {Partial<import("#core/run_list.js").Filter>} */ some) => {
    setFilter({ ...filter, ...some });
    setMost(MOST_ROWS);
  };
  const failed = rows.filter((row) => standing(row) === "failure").length;
  return html`<section class="home" aria-labelledby="home-title">
    <${Filters} runs=${runs} filter=${filter} pins=${pins} onChange=${change} />
    <div class="run-list">
      <header><h2 id="home-title" tabindex="-1" ref=${heading}>Runs</h2>
        ${folders.map((one) => html`<span class="chip" title=${one}>folder ${shorten(lastWord(one), 24)}</span>`)}
        ${journals.map((one) => html`<${JournalChip} ...${one} />`)}
        <span class="spread"></span>
        <span class="hint">${rows.length.toLocaleString("en")} runs${failed > 0 && `, ${failed} failed`}</span>
        <input placeholder="machine, robot, state, reason" aria-label="search runs" value=${filter.text}
          onInput=${(/** @type {Event} */ e) => change({ text: fieldValue(e) })} />
        ${
          runs.filter((row) => row.live).length > 1 &&
          html`<button onClick=${() => {
            store.fleetOpen.value = true;
          }}>Fleet</button>`
        }
        <button onClick=${openSimulations}>Simulate</button>
        ${store.model.value && html`<button onClick=${() => showHome(false)}>Close</button>`}</header>
      ${store.runsProblem.value && html`<p class="error">${store.runsProblem.value}</p>`}
      ${!runs.length && store.runsKnown.value && html`<${NoRuns} />`}
      ${
        runs.length > 0 &&
        !rows.length &&
        html`<div class="empty-list"><p>No run is ${filterText(filter)}.</p>
          <button onClick=${() => setFilter(ALL)}>Clear filters</button></div>`
      }
      ${rows.length > 0 && html`<${Rows} rows=${rows.slice(0, most)} pins=${pins} />`}
      <${More} left=${rows.length - most} onMore=${() => setMost(most + 200)} />
    </div>
  </section>`;
}

/** @param {{ name: string, problem: string }} props */
const JournalChip = ({ name, problem }) =>
  html`<span class=${problem ? "chip bad" : "chip"} title=${problem || name}>journal ${shorten(lastWord(name), 24)}${
    problem && ": not readable"
  }</span>`;

function NoRuns() {
  const text = "smachpy run patrol --start-robot --view";
  const copy = () => navigator.clipboard?.writeText(text).then(() => store.notify("copied"));
  return html`<div class="empty-list"><p>No runs yet. Make one:</p>
    <p><code>${text}</code> <button class="small" onClick=${copy}>Copy</button></p></div>`;
}

/**
 * @param {{ runs: RunRow[], filter: import("#core/run_list.js").Filter, pins: Set<string>,
 *   onChange: (some: Partial<import("#core/run_list.js").Filter>) => void }} props
 */
function Filters({ runs, filter, pins, onChange }) {
  const counts = countsOf(runs, pins);
  const choice = (
    /** @type {string} */ name,
    /** @type {number} */ count,
    /** @type {boolean} */ on,
    /** @type {() => void} */ choose,
  ) =>
    html`<li><button class=${on ? "on" : ""} aria-pressed=${on} onClick=${choose}>
      <span>${shorten(name, 24)}</span><span class="number">${count}</span></button></li>`;
  const names = (/** @type {"machine" | "robot"} */ what, /** @type {[string, number][]} */ found) =>
    found.length > 0 &&
    html`<h3>${what === "machine" ? "Machine" : "Robot"}</h3><ul>${found
      .slice(0, MOST_NAMES)
      .map(([name, count]) =>
        choice(name, count, filter[what] === name, () => onChange({ [what]: filter[what] === name ? null : name })),
      )}</ul>`;
  return html`<nav class="filters" aria-label="filters">
    <h3>Show</h3><ul>${SHOWN.filter(
      (show) => show === "all" || (counts.get(show) ?? 0) > 0 || filter.show === show,
    ).map((show) =>
      choice(SHOWN_NAMES[show], counts.get(show) ?? 0, filter.show === show, () => onChange({ show })),
    )}</ul>
    ${names(
      "machine",
      tally(runs, (row) => [row.machine]),
    )}
    ${names(
      "robot",
      tally(runs, (row) => row.robots),
    )}
  </nav>`;
}

/** @param {{ rows: RunRow[], pins: Set<string> }} props */
function Rows({ rows, pins }) {
  const today = new Date();
  return html`<table class="runs"><thead><tr><th><span class="hidden">pinned</span></th><th>Outcome</th>
      <th>Machine and reason</th><th class="right">Duration</th><th>States</th><th class="right">Began</th></tr></thead>
    <tbody>${rows.map(
      (row) => html`<${Row} key=${row.id} row=${row} pinned=${pins.has(pinOf(row))} today=${today} />`,
    )}</tbody>
  </table>`;
}

/** @param {{ row: RunRow, pinned: boolean, today: Date }} props */
function Row({ row, pinned, today }) {
  const kind = standing(row);
  const known = row.problem ? "unreadable" : shorten(row.outcome ?? "no end", 20);
  const colour = row.asks ? "waiting" : (KINDS[kind] ?? kind);
  const word = row.asks ? "asks you" : (WORDS[kind] ?? known);
  const seconds = secondsOf(row, Date.now());
  const opens = row.name !== null || row.file !== "";
  const open = () => opens && openRun(row.id);
  const onKeyDown = (/** @type {KeyboardEvent} */ e) => {
    if (e.key === "Enter" && e.target === e.currentTarget) open();
  };
  const pin = (/** @type {Event} */ e) => {
    e.stopPropagation();
    store.togglePin(pinOf(row));
  };
  const outage = outageText(row);
  const classes = `${row.problem ? "bad" : ""}${opens ? "" : " closed"}`;
  return html`<tr tabindex="0" class=${classes} onClick=${open} onKeyDown=${onKeyDown}>
    <td><button class=${pinned ? "pin on" : "pin"} aria-pressed=${pinned} title=${pinned ? "pinned" : "pin"}
      aria-label=${`pin ${row.machine}`} onClick=${pin}>${pinned ? "\u2605" : "\u2606"}</button></td>
    <td><span class=${`pill-text ${colour}`}>${row.asks ? "?" : SIGNS[kind]} ${word}</span></td>
    <td class="what"><b>${shorten(row.machine, 40)}</b> <span class="hint">${row.robots.join(", ")}</span>
      ${outage && html` <span class="pill-text waiting">${outage}</span>`}
      <${MissionButtons} mission=${row.mission} />
      <small title=${row.problem || row.reason}>${shorten(row.problem || row.reason, 110)}</small></td>
    <td class="right">${seconds === null ? "" : duration(seconds)}</td>
    <td class="strip-cell"><${Strip} row=${row} seconds=${seconds} /></td>
    <td class="right">${row.began === null ? "" : beganText(row.began, today)}</td></tr>`;
}

/** @param {{ mission: Mission | null }} props */
function MissionButtons({ mission }) {
  if (!mission?.can.length || !hasToken()) return null;
  return mission.can.map((what) => {
    const onClick = (/** @type {Event} */ e) => {
      e.stopPropagation();
      commandMission(mission, what);
    };
    return html` <button class="small" aria-label=${`${what} ${mission.id}`} onClick=${onClick}>${
      what === "resume" ? "Resume" : "Cancel"
    }</button>`;
  });
}

/**
 * The strip of a run's states in the colours of their outcomes.
 * @param {{ row: RunRow, seconds: number | null }} props
 */
function Strip({ row, seconds }) {
  if (!seconds) return null;
  const rows = row.strip.reduce((most, [at]) => Math.max(most, at + 1), 1);
  const tall = 24 / rows;
  const bar = (/** @type {RunRow["strip"][0]} */ [at, name, from, to, kind]) => {
    const x = (100 * from) / seconds;
    const wide = Math.max(0.6, (100 * ((to ?? seconds) - from)) / seconds - 0.4);
    return html`<rect class=${kind} x=${`${x}%`} y=${at * tall + 1} width=${`${wide}%`} height=${Math.max(2, tall - 2)}
      rx=${rows > 2 ? 0 : 3}><title>${name}: ${duration((to ?? seconds) - from)}</title></rect>`;
  };
  const gap = (/** @type {[number, number]} */ [from, to]) => {
    const [x, wide] = [(100 * from) / seconds, Math.max(0.8, (100 * (to - from)) / seconds)];
    return html`<rect class="outage" x=${`${x}%`} y="0" width=${`${wide}%`} height="24">
      <title>no process ran it for ${duration(to - from)}</title></rect>`;
  };
  const names = row.strip.slice(0, 12).map((piece) => piece[1]);
  return html`<svg class="run-strip" height="24" role="img" aria-label=${names.join(", ")}>
    ${row.strip.map(bar)}${row.outages.map(gap)}</svg>`;
}
