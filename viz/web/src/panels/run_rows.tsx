// The rows of the list of runs.

import { askFirst } from "#core/commands.ts";
import { hasToken } from "#core/requests.ts";
import { beganText, outageText, pinOf, secondsOf, standing } from "#core/run_list.ts";
import { commandMission, openRun } from "#core/run_requests.ts";
import { store } from "#core/store.ts";
import { duration, lastWord, shorten } from "#core/text.ts";
import type { Mission, RunRow } from "#core/types.ts";

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
/** The others have the names of their colours. */
const KINDS: Record<string, string> = { live: "active", cut: "waiting", interrupted: "waiting", queued: "waiting" };

export function Rows({ rows, pins }: { rows: RunRow[]; pins: Set<string> }) {
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

/** The robots of a run; without any, the name that tells a live run from others of its machine. */
const whoseText = (row: RunRow) =>
  row.robots.join(", ") ||
  (row.live && row.name && row.name !== row.machine && row.name !== titleOf(row) ? row.name : "");
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
        <b>{shorten(titleOf(row), 40)}</b> <span class="hint">{whoseText(row)}</span>
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
