// The home page: a list of live and past runs, with filters and pins.

import { useEffect, useRef, useState } from "preact/hooks";
import { showPage } from "#core/pages.ts";
import type { Filter } from "#core/run_list.ts";
import { chosen, countsOf, filterText, SHOWN, SHOWN_NAMES, standing, tally } from "#core/run_list.ts";
import { refreshRuns } from "#core/run_requests.ts";
import { copyText } from "#core/share.ts";
import { store } from "#core/store.ts";
import { endOfPath, lastWord, shorten } from "#core/text.ts";
import type { RunRow } from "#core/types.ts";
import { fieldValue, More } from "#panels/components.tsx";
import { Rows } from "#panels/run_rows.tsx";

const MOST_ROWS = 40; // at first
const MOST_NAMES = 8; // in a list of filters
const REFRESH_MS = 5000; // changes in journals are found only by asking again

export const HomePage = () => (store.view.pageShown.value === "runs" ? <OpenHome /> : null);

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
  store.playback.watchSlowly();
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
              folder {shorten(endOfPath(one, folders), 32)}
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
          <button onClick={() => showPage("simulate")}>Simulate</button>
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
  return (
    <div class="empty-list">
      <p>No runs yet. Make one:</p>
      <p>
        <code>{text}</code>{" "}
        <button class="small" onClick={() => copyText(text)}>
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
