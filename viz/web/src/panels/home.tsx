// The home page: a list of live and past runs, with filters and pins.

import { useEffect, useRef, useState } from "preact/hooks";
import { askFirst } from "#core/commands.ts";
import { commandMission, hasToken, openRun, refreshRuns } from "#core/connection.ts";
import { showPage } from "#core/pages.ts";
import type { Filter } from "#core/run_list.ts";
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
} from "#core/run_list.ts";
import { store } from "#core/store.ts";
import { duration, shorten } from "#core/text.ts";
import type { Mission, RunRow } from "#core/types.ts";
import { fieldValue, More } from "#panels/components.tsx";

const MOST_ROWS = 40; // at first
const MOST_NAMES = 8; // in a list of filters
const SIGNS: Record<string, string> = {
  live: "\u25cf",
  success: "\u2713",
  failure: "\u2715",
  preempted: "\u2298",
  other: "\u00b7",
  cut: "\u2026",
  interrupted: "\u2016",
  queued: "\u2026",
};
const WORDS: Record<string, string> = { live: "running", interrupted: "interrupted", queued: "queued" };
const REFRESH_MS = 5000; // changes in journals are found only by asking again
/** The others have the names of their colours. */
const KINDS: Record<string, string> = { live: "active", cut: "waiting", interrupted: "waiting", queued: "waiting" };

export const HomePage = () => (store.view.pageShown.value === "runs" ? <OpenHome /> : null);

const openSimulations = () => {
  store.view.simulateOpen.value = true;
};

const lastWord = (path: string) => path.split("/").at(-1) || path;

const ALL: Filter = { show: "all", machine: null, robot: null, text: "" };

function OpenHome() {
  const [filter, setFilter] = useState(ALL);
  const [most, setMost] = useState(MOST_ROWS);
  const heading = useRef<HTMLHeadingElement | null>(null);
  const { machines } = store.data;
  useEffect(() => heading.current?.focus(), []);
  useEffect(() => {
    refreshRuns();
  }, [machines.value]);
  const { runs, folders, journals } = store.data.runs.value;
  useEffect(() => {
    if (!journals.length) return;
    const timer = setInterval(refreshRuns, REFRESH_MS);
    return () => clearInterval(timer);
  }, [journals.length > 0]);
  store.playback.slowTick.value;
  const pins = store.view.pins.value;
  const rows = chosen(runs, filter, pins);
  const change = (some: Partial<Filter>) => {
    setFilter({ ...filter, ...some });
    setMost(MOST_ROWS);
  };
  const failed = rows.filter((row) => standing(row) === "failure").length;
  const failedText = failed ? `, ${failed} failed` : "";
  return (
    <section class="home" aria-labelledby="home-title">
      <Filters runs={runs} filter={filter} pins={pins} onChange={change} />
      <div class="run-list">
        <header>
          <h2 id="home-title" tabindex={-1} ref={heading}>
            Runs
          </h2>
          {folders.map((one) => (
            <span class="chip" title={one}>
              folder {shorten(lastWord(one), 24)}
            </span>
          ))}
          {journals.map((one) => (
            <JournalChip {...one} />
          ))}
          <span class="spread" />
          <span class="hint" role="status">
            {store.data.runsKnown.value
              ? `${rows.length.toLocaleString("en")} run${rows.length === 1 ? "" : "s"}${failedText}`
              : "reading the runs\u2026"}
          </span>
          <input
            placeholder="machine, robot, state, reason"
            aria-label="search runs"
            value={filter.text}
            onInput={(e: Event) => change({ text: fieldValue(e) })}
          />
          {runs.filter((row) => row.live).length > 1 && <button onClick={() => showPage("fleet")}>Fleet</button>}
          <button onClick={openSimulations}>Simulate</button>
          {store.data.model.value && <button onClick={() => showPage("machine")}>Close</button>}
        </header>
        {store.data.runsProblem.value && <p class="error">{store.data.runsProblem.value}</p>}
        {!runs.length && store.data.runsKnown.value && <NoRuns />}
        {runs.length > 0 && !rows.length && (
          <div class="empty-list">
            <p>No run is {filterText(filter)}.</p>
            <button onClick={() => setFilter(ALL)}>Clear filters</button>
          </div>
        )}
        {rows.length > 0 && <Rows rows={rows.slice(0, most)} pins={pins} />}
        <More left={rows.length - most} onMore={() => setMost(most + 200)} />
      </div>
    </section>
  );
}

const JournalChip = ({ name, problem }: { name: string; problem: string }) => (
  <span class={problem ? "chip bad" : "chip"} title={problem || name}>
    journal {shorten(lastWord(name), 24)}
    {problem && ": not readable"}
  </span>
);

function NoRuns() {
  const text = "smachpy run patrol --start-robot --view";
  const copy = () => navigator.clipboard?.writeText(text).then(() => store.view.notify("copied"));
  return (
    <div class="empty-list">
      <p>No runs yet. Make one:</p>
      <p>
        <code>{text}</code>{" "}
        <button class="small" onClick={copy}>
          Copy
        </button>
      </p>
    </div>
  );
}

function Filters({
  runs,
  filter,
  pins,
  onChange,
}: {
  runs: RunRow[];
  filter: Filter;
  pins: Set<string>;
  onChange: (some: Partial<Filter>) => void;
}) {
  const counts = countsOf(runs, pins);
  const choice = (name: string, count: number, on: boolean, choose: () => void) => (
    <li>
      <button class={on ? "on" : ""} aria-pressed={on} onClick={choose}>
        <span>{shorten(name, 24)}</span>
        <span class="number">{count}</span>
      </button>
    </li>
  );
  const names = (what: "machine" | "robot", found: [string, number][]) =>
    found.length > 0 && (
      <>
        <h3>{what === "machine" ? "Machine" : "Robot"}</h3>
        <ul>
          {found
            .slice(0, MOST_NAMES)
            .map(([name, count]) =>
              choice(name, count, filter[what] === name, () =>
                onChange({ [what]: filter[what] === name ? null : name }),
              ),
            )}
        </ul>
      </>
    );
  return (
    <nav class="filters" aria-label="filters">
      <h3>Show</h3>
      <ul>
        {SHOWN.filter((show) => show === "all" || (counts.get(show) ?? 0) > 0 || filter.show === show).map((show) =>
          choice(SHOWN_NAMES[show], counts.get(show) ?? 0, filter.show === show, () => onChange({ show })),
        )}
      </ul>
      {names(
        "machine",
        tally(runs, (row) => [row.machine]),
      )}
      {names(
        "robot",
        tally(runs, (row) => row.robots),
      )}
    </nav>
  );
}

function Rows({ rows, pins }: { rows: RunRow[]; pins: Set<string> }) {
  const today = new Date();
  return (
    <table class="runs">
      <thead>
        <tr>
          <th>
            <span class="hidden">pinned</span>
          </th>
          <th>Outcome</th>
          <th>Machine and reason</th>
          <th class="right">Duration</th>
          <th>States</th>
          <th class="right">Began</th>
        </tr>
      </thead>
      <tbody>
        {rows.map((row) => (
          <Row key={row.id} row={row} pinned={pins.has(pinOf(row))} today={today} />
        ))}
      </tbody>
    </table>
  );
}

const UNNAMED = "SM_ROOT"; // what classic programs call every machine

const titleOf = (row: RunRow) => (row.machine === UNNAMED && row.name ? row.name : row.machine);

function Row({ row, pinned, today }: { row: RunRow; pinned: boolean; today: Date }) {
  const kind = standing(row);
  const known = row.problem ? "unreadable" : shorten(row.outcome ?? "no end", 20);
  const colour = row.asks ? "waiting" : (KINDS[kind] ?? kind);
  const word = row.asks ? "asks you" : (WORDS[kind] ?? known);
  const seconds = secondsOf(row, Date.now());
  const opens = row.name !== null || row.file !== "";
  const open = () => opens && openRun(row.id);
  const onKeyDown = (e: KeyboardEvent) => {
    if (e.key === "Enter" && e.target === e.currentTarget) open();
  };
  const pin = (e: Event) => {
    e.stopPropagation();
    store.view.togglePin(pinOf(row));
  };
  const outage = outageText(row);
  const classes = `${row.problem ? "bad" : ""}${opens ? "" : " closed"}`;
  return (
    <tr tabindex={0} class={classes} onClick={open} onKeyDown={onKeyDown}>
      <td>
        <button
          class={pinned ? "pin on" : "pin"}
          aria-pressed={pinned}
          title={pinned ? "pinned" : "pin"}
          aria-label={`pin ${row.machine}`}
          onClick={pin}
        >
          {pinned ? "\u2605" : "\u2606"}
        </button>
      </td>
      <td>
        <span class={`pill-text ${colour}`}>
          {row.asks ? "?" : SIGNS[kind]} {word}
        </span>
      </td>
      <td class="what">
        <b>{shorten(titleOf(row), 40)}</b> <span class="hint">{row.robots.join(", ")}</span>
        {outage && <span class="pill-text waiting">{outage}</span>} <MissionButtons row={row} />
        <small title={row.problem || row.reason}>{shorten(row.problem || row.reason, 110)}</small>
      </td>
      <td class="right">{seconds === null ? "" : duration(seconds)}</td>
      <td class="strip-cell">
        <Strip row={row} seconds={seconds} />
      </td>
      <td class="right">{row.began === null ? "" : beganText(row.began, today)}</td>
    </tr>
  );
}

function askForMission(row: RunRow, mission: Mission, what: string) {
  const robots = row.robots.length ? ` on ${row.robots.join(", ")}` : "";
  const where = mission.active.length ? ` in ${mission.active.map(lastWord).join(", ")}` : "";
  const resumes = what === "resume";
  const now = () => store.data.runs.value.runs.find((one) => one.mission?.id === mission.id)?.mission;
  askFirst({
    title: `${resumes ? "Resume" : "Cancel"} ${row.machine}${robots}?`,
    yes: resumes ? "Resume" : "Cancel the mission",
    lines: () => [
      `The mission ${mission.id} is ${mission.status}${where}.`,
      resumes
        ? "A process on the viewer's computer goes on with it at once, and moves its robots."
        : "It is preempted, now or when it is resumed, and ends.",
    ],
    situation: () => JSON.stringify([store.view.pageShown.value, now()?.status, now()?.can]),
    give: () => commandMission(mission, what),
  });
}

function MissionButtons({ row }: { row: RunRow }) {
  const { mission } = row;
  if (!mission?.can.length || !hasToken()) return null;
  return mission.can.map((what) => {
    const onClick = (e: Event) => {
      e.stopPropagation();
      askForMission(row, mission, what);
    };
    return (
      <>
        {" "}
        <button class="small" aria-label={`${what} ${mission.id}`} onClick={onClick}>
          {what === "resume" ? "Resume" : "Cancel"}
        </button>
      </>
    );
  });
}

/** The strip of a run's states in the colours of their outcomes. */
function Strip({ row, seconds }: { row: RunRow; seconds: number | null }) {
  if (!seconds) return null;
  const rows = row.strip.reduce((most, [at]) => Math.max(most, at + 1), 1);
  const tall = 24 / rows;
  const bar = ([at, name, from, to, kind]: RunRow["strip"][0]) => {
    const x = (100 * from) / seconds;
    const wide = Math.max(0.6, (100 * ((to ?? seconds) - from)) / seconds - 0.4);
    return (
      <rect
        class={kind}
        x={`${x}%`}
        y={at * tall + 1}
        width={`${wide}%`}
        height={Math.max(2, tall - 2)}
        rx={rows > 2 ? 0 : 3}
      >
        <title>
          {name}: {duration((to ?? seconds) - from)}
        </title>
      </rect>
    );
  };
  const gap = ([from, to]: [number, number]) => {
    const [x, wide] = [(100 * from) / seconds, Math.max(0.8, (100 * (to - from)) / seconds)];
    return (
      <rect class="outage" x={`${x}%`} y="0" width={`${wide}%`} height="24">
        <title>no process ran it for {duration(to - from)}</title>
      </rect>
    );
  };
  const names = row.strip.slice(0, 12).map((piece) => piece[1]);
  return (
    <svg class="run-strip" height="24" role="img" aria-label={names.join(", ")}>
      {row.strip.map(bar)}
      {row.outages.map(gap)}
    </svg>
  );
}
