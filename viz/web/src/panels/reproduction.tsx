// The run shown, run again: buttons, what was found, and both runs one under the other.

import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { choose } from "#core/connection.ts";
import type { Reproduction } from "#core/reproduction.ts";
import {
  canReproduce,
  closeReproduction,
  differenceAt,
  reproduce,
  reproduction,
  seekDifference,
  stopReproduction,
  twoRunsShown,
} from "#core/reproduction.ts";
import { copyText, saveFile } from "#core/share.ts";
import { store } from "#core/store.ts";
import { duration, shorten } from "#core/text.ts";
import type { Bar, Lane } from "#core/two_runs.ts";
import { around, twoRuns } from "#core/two_runs.ts";
import type { Found, RunDifference } from "#core/wire.ts";
import type { Page } from "#drawing/page.ts";
import { fieldValue, Section } from "#panels/components.tsx";

const MOST_LINES = 6;
const MOST_BARS = 400; // of a lane
const TICKS = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 14_400];

/** The buttons for a finished run. */
export function ReproduceButtons({ class: name = "" }: { class?: string }) {
  if (!canReproduce()) return null;
  const one = reproduction();
  const runs = one !== null && !one.found && !one.problem;
  return (
    <span class={`again-buttons ${name}`}>
      <button
        class="small"
        disabled={runs}
        title="run the recorded mission again: today's code, in virtual time, answered as it was then"
        onClick={() => reproduce("run")}
      >
        Reproduce
      </button>
      <button class="small" disabled={runs} title="write a pytest test of this run" onClick={() => reproduce("test")}>
        Make a test
      </button>
    </span>
  );
}

export function ReproductionPanel({ page }: { page: Page }) {
  const one = reproduction();
  if (!one) return null;
  return (
    <Section title={one.what === "test" ? "A test of this run" : "This run with today's code"}>
      <div class="again">
        <span class="again-tools">
          {!one.found && !one.problem && (
            <button class="small" onClick={() => stopReproduction(one.id)}>
              Stop
            </button>
          )}
          <button class="small" aria-label="close" onClick={closeReproduction}>
            ✕
          </button>
        </span>
        <div role="status">
          <Result one={one} page={page} />
        </div>
      </div>
    </Section>
  );
}

function Result({ one, page }: { one: Reproduction; page: Page }) {
  if (one.problem) return <p class="problem">{shorten(one.problem, 600)}</p>;
  const { found } = one;
  if (!found)
    return (
      <p>
        <progress /> {one.what === "test" ? "runs it again and again, to leave out what does not matter" : "runs"}…
      </p>
    );
  if (found.kind === "test") return <WrittenTest found={found} />;
  if (found.kind === "failed") return <p class="problem">{shorten(found.text.join("\n"), 900)}</p>;
  const { difference } = found;
  return (
    <>
      {difference ? (
        <FirstDifference difference={difference} page={page} />
      ) : (
        <p>
          <span class="pill-text success">✓ the same</span> {found.same} of {found.events} events.
        </p>
      )}
      <Lines title="Changed" lines={found.changed} />
      <Lines title="Notes" lines={found.notes} />
      <p class="again-actions">
        {one.now && (
          <button
            class={twoRunsShown.value ? "small on" : "small"}
            aria-pressed={twoRunsShown.value}
            onClick={() => {
              twoRunsShown.value = !twoRunsShown.value;
            }}
          >
            Both runs
          </button>
        )}
        {found.machine && (
          <button class="small" onClick={() => choose(found.machine)}>
            Open today's run
          </button>
        )}
      </p>
    </>
  );
}

function FirstDifference({ difference, page }: { difference: RunDifference; page: Page }) {
  const goThere = () => {
    seekDifference();
    page.goTo(difference.path);
  };
  const at = differenceAt();
  const side = (what: string, first: string, next: string[]) => (
    <tr>
      <th scope="row">{what}</th>
      <td>
        <b>{shorten(first, 200)}</b>
        {next.map((line) => (
          <small>then {shorten(line, 160)}</small>
        ))}
      </td>
    </tr>
  );
  return (
    <>
      <button class="step first-difference" onClick={goThere}>
        First difference {at !== null && <>at {store.clock.instantText(at)}</>}, event {difference.number}
      </button>
      {difference.before.length > 0 && (
        <p class="hint">the same until {difference.before.map((line) => shorten(line, 120)).join("; ")}</p>
      )}
      <table class="two-sides">
        {side("recorded", difference.recorded, difference.recorded_next)}
        {side("today", difference.now, difference.now_next)}
      </table>
    </>
  );
}

function Lines({ title, lines }: { title: string; lines: string[] }) {
  if (!lines.length) return null;
  return (
    <>
      <h3>{title}</h3>
      <ul class="again-lines">
        {lines.slice(0, MOST_LINES).map((line) => (
          <li>{shorten(line, 300)}</li>
        ))}
        {lines.length > MOST_LINES && <li>and {lines.length - MOST_LINES} more</li>}
      </ul>
    </>
  );
}

function WrittenTest({ found }: { found: Found }) {
  const save = () => saveFile(new Blob([found.test], { type: "text/x-python" }), found.file);
  const outcomes = store.data.model.value?.root.outcomes ?? [];
  return (
    <>
      <p class="again-actions">
        <b>{found.file}</b>
        <button class="small" onClick={() => copyText(found.test)}>
          Copy
        </button>
        <button class="small" onClick={save}>
          Save
        </button>
        <label>
          expects{" "}
          <select aria-label="what the test expects" onChange={(e: Event) => reproduce("test", fieldValue(e))}>
            <option value="">what was recorded, or choose</option>
            {outcomes.map((name) => (
              <option value={name}>{name}</option>
            ))}
          </select>
        </label>
      </p>
      <Lines title="Notes" lines={found.notes} />
      <pre class="written-test" tabindex={0}>
        {found.test}
      </pre>
    </>
  );
}

// -- both runs ----------------------------------------------------------------------------------

/** Both runs over the timeline, if they are asked for. */
export function TwoRunsView({ page }: { page: Page }) {
  const one = reproduction();
  const model = store.data.model.value;
  if (!twoRunsShown.value || !one?.now || !one.found || !model) return null;
  return <OpenTwoRuns page={page} one={one} found={one.found} />;
}

function OpenTwoRuns({ page, one, found }: { page: Page; one: Reproduction; found: Found }) {
  const [aligned, setAligned] = useState(true);
  const [whole, setWhole] = useState(false);
  const model = store.data.model.value;
  if (!model || !one.now) return null;
  const { difference } = found;
  const both = twoRuns({ recorded: store.data.run, now: one.now, model }, difference, aligned);
  const at = difference ? (aligned ? 0 : difference.at) : null;
  const range = whole || at === null ? { from: both.from, to: both.to } : around(both, at);
  const choice = (text: string, on: boolean, choose: () => void) => (
    <button class={on ? "small on" : "small"} aria-pressed={on} onClick={choose}>
      {text}
    </button>
  );
  return (
    <section class="two-runs" aria-label="the recorded run and today's, one under the other">
      <header>
        {difference && (
          <span class="group">
            {choice("from the difference", aligned, () => setAligned(true))}
            {choice("from the begin", !aligned, () => setAligned(false))}
          </span>
        )}
        {difference && choice("whole", whole, () => setWhole(!whole))}
        <span class="hint">{difference ? `the same up to the line: ${found.same} events` : "the same throughout"}</span>
        <span class="spread" />
        {choice("One run", false, () => {
          twoRunsShown.value = false;
        })}
      </header>
      <Side title="recorded" lanes={both.recorded} range={range} at={at}>
        {(bar) => {
          store.playback.seek(bar.at);
          page.goTo(bar.path);
        }}
      </Side>
      <Side title="today" lanes={both.now} range={range} at={at}>
        {(bar) => page.goTo(bar.path)}
      </Side>
      <Axis range={range} relative={aligned && difference !== null} />
    </section>
  );
}

type Range = { from: number; to: number };
const percent = (t: number, { from, to }: Range) => (100 * (t - from)) / Math.max(1e-6, to - from);

function Side({
  title,
  lanes,
  range,
  at,
  children: pick,
}: {
  title: string;
  lanes: Lane[];
  range: Range;
  at: number | null;
  children: (bar: Bar) => void;
}) {
  const seen = (bar: Bar) => bar.to >= range.from && bar.from <= range.to;
  return (
    <div class="side" role="group" aria-label={title}>
      <h3>{title}</h3>
      {lanes.map((lane) => (
        <div class="lane" key={lane.path}>
          <span title={lane.path}>{shorten(lane.name, 40)}</span>
          <div class="bars">
            {lane.bars
              .filter(seen)
              .slice(0, MOST_BARS)
              .map((bar) => (
                <BarButton bar={bar} range={range} at={at} onPick={() => pick(bar)} />
              ))}
          </div>
        </div>
      ))}
      {at !== null && (
        <div class="difference-line">
          <i style={{ left: `${percent(at, range)}%` }} />
        </div>
      )}
    </div>
  );
}

function BarButton({ bar, range, at, onPick }: { bar: Bar; range: Range; at: number | null; onPick: () => void }) {
  const left = Math.max(0, percent(bar.from, range));
  const wide = Math.min(100, percent(bar.to, range)) - left;
  const took = duration(bar.to - bar.from);
  const isBefore = at !== null && !bar.differs && bar.to < at;
  return (
    <button
      class={`bar ${bar.kind} ${bar.differs ? "differs" : ""} ${isBefore ? "before" : ""}`}
      style={{ left: `${left}%`, width: `${wide}%` }}
      title={`${bar.path}: ${took}${bar.differs ? ", here the runs differ" : ""}`}
      onClick={onPick}
    >
      {bar.name} {took}
    </button>
  );
}

function Axis({ range, relative }: { range: Range; relative: boolean }) {
  const step = TICKS.find((one) => (range.to - range.from) / one <= 8) ?? 86_400;
  const ticks: ComponentChildren[] = [];
  for (let t = Math.ceil(range.from / step) * step; t <= range.to; t += step)
    ticks.push(
      <span style={{ left: `${percent(t, range)}%` }}>
        {relative ? `${t > 0 ? "+" : ""}${Number(t.toFixed(1))} s` : store.clock.runText(1000 * t, step < 1 ? 1 : 0, 0)}
      </span>,
    );
  return (
    <div class="lane axis" aria-hidden="true">
      <span />
      <div class="bars">{ticks}</div>
    </div>
  );
}
