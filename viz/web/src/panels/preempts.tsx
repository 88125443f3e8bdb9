// The course of a preempt: its origin, the states that have serviced it, and those for which it waits.

import { ms } from "#core/fold.ts";
import { innermost } from "#core/lists.ts";
import { store } from "#core/store.ts";
import { askerText, duration, holdText } from "#core/text.ts";
import type { Preempt, PreemptedSpan, RunState, Span } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { Section, StateLink } from "#panels/components.tsx";

const RECENT_MS = 30_000; // time for which a finished preempt is shown while the mission runs
const ORDINARY_MS = 1000;
const MOST_ROWS = 24;

/** Whether it is only the normal end of a concurrence: requested by it, and soon over. */
const isOrdinary = ({ from, to, rows }: Preempt) =>
  to !== null &&
  to - from < ORDINARY_MS &&
  rows.every((row) => row.asked?.source === "concurrence" && row.abandoned === null);

export function Preempts({ page, data, now }: { page: Page; data: RunState; now: number }) {
  const found = store.data.run.preemptAt(now);
  if (!found || found.from < (ms(data.started) ?? 0)) return null;
  if (found.to !== null && data.ended == null && now - found.to > RECENT_MS) return null;
  if (isOrdinary(found)) return null;
  const askers = [...new Set(found.rows.map((row) => askerText(row.asked) ?? "not recorded"))];
  const depth = (row: Span) => row.path.split("/").length;
  const rows = [...found.rows].sort((a, b) => depth(a) - depth(b) || a.preempt - b.preempt).slice(0, MOST_ROWS);
  const left = found.rows.length - rows.length;
  return (
    <Section title="Preempt">
      <div class="preempt">
        <dl class="facts">
          <dt>asked by</dt>
          <dd>
            {askers.map((one) => (
              <div>{one}</div>
            ))}
          </dd>
          <dt>first asked</dt>
          <dd>
            <StateLink path={found.rows[0].path} page={page} /> {duration((now - found.from) / 1000)} ago
          </dd>
          <Length found={found} now={now} page={page} />
        </dl>
        <div class="waterfall" role="list">
          {rows.map((row) => (
            <Row row={row} found={found} now={now} page={page} />
          ))}
          {left > 0 && <div class="hint">and {left} more</div>}
        </div>
        <p class="hint key">
          <span>
            <i class="preempted" /> asked, not serviced
          </span>
          <span>
            <i class="asked" /> until serviced
          </span>{" "}
          <span>
            <i class="success" /> cleaning up
          </span>
        </p>
      </div>
    </Section>
  );
}

/** The duration of a preempt. */
function Length({ found, now, page }: { found: Preempt; now: number; page: Page }) {
  if (found.to === null)
    return (
      <>
        <dt>held up by</dt>
        <dd>
          {found.holds.map((row, i) => (
            <>
              {i > 0 ? ", " : ""}
              <b>
                <StateLink path={row.path} page={page} />
              </b>{" "}
              for {holdText(row, now)}
            </>
          ))}
        </dd>
      </>
    );
  return (
    <>
      <dt>took</dt>
      <dd>
        {duration((found.to - found.from) / 1000)}; longest: <StateLink path={longest(found.rows).path} page={page} />
      </dd>
    </>
  );
}

/** A state that was asked to stop, and its part of the time. */
function Row({ row, found, now, page }: { row: PreemptedSpan; found: Preempt; now: number; page: Page }) {
  const whole = Math.max((found.to ?? now) - found.from, 1);
  const at = (t: number) => `${((t - found.from) / whole) * 100}%`;
  const bar = (from: number, to: number, kind: string) => {
    const width = `${Math.max(1.5, ((to - from) / whole) * 100)}%`;
    return <i class={kind} style={{ left: at(from), width }} />;
  };
  const until = row.to ?? now;
  const answered = row.abandoned ?? row.serviced ?? until;
  const waits = row.to === null && row.serviced === null;
  return (
    <div role="listitem" title={titleOf(row)}>
      <StateLink path={row.path} page={page} />
      <span aria-hidden="true">
        {bar(row.preempt, answered, waits ? "preempted" : "asked")}
        {answered < until && bar(answered, until, row.abandoned !== null ? "failure" : "success")}
        {row.serviced !== null && <b style={{ left: at(row.serviced) }} />}
      </span>
      <small>{rowText(row, found, now)}</small>
    </div>
  );
}

function rowText(row: PreemptedSpan, found: Preempt, now: number) {
  const since = (t: number) => duration((now - t) / 1000);
  if (row.abandoned !== null) return "\u2715 abandoned";
  if (row.to !== null) return `\u2713 ${duration((row.to - row.preempt) / 1000)}`;
  if (row.serviced !== null) return `\u2713 cleaning up ${since(row.serviced)}`;
  return found.holds.some((one) => one.path === row.path) ? `\u25a0 ${since(row.preempt)}` : "waits for children";
}

/** The innermost state that took the longest time. */
function longest(rows: PreemptedSpan[]) {
  const leaves = innermost(rows, (row) => row.path);
  const length = (row: PreemptedSpan) => (row.to ?? row.preempt) - row.preempt;
  return leaves.reduce((a, b) => (length(b) > length(a) ? b : a));
}

function titleOf(row: PreemptedSpan) {
  const after = (t: number) => `after ${((t - row.preempt) / 1000).toFixed(3)} s`;
  const lines = [row.path, `asked by ${askerText(row.asked) ?? "?"}`];
  if (row.serviced !== null) lines.push(`serviced ${after(row.serviced)}`);
  if (row.abandoned !== null) lines.push(`abandoned ${after(row.abandoned)}`);
  if (row.to !== null) lines.push(`ended with ${row.outcome ?? "an unknown outcome"} ${after(row.to)}`);
  if (row.asked?.grace != null) lines.push(`abandoned after ${row.asked.grace} s at the latest`);
  return lines.join("\n");
}
