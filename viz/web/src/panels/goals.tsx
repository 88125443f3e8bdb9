// The goals sent by the machine.

import { useState } from "preact/hooks";
import { outcomeClass } from "#core/outcomes.ts";
import { purposeOf } from "#core/purposes.ts";
import { store } from "#core/store.ts";
import { duration } from "#core/text.ts";
import type { GoalRun, Progress, RunState } from "#core/types.ts";
import { pretty } from "#core/values.ts";
import type { Page } from "#drawing/page.ts";
import { Pill, Section, StateLink } from "#panels/components.tsx";

const RECENT_MS = 60_000; // time for which an ended goal is shown
const MOST = 6; // running goals that are shown
const MOST_ENDED = 3;
const MARKS: Record<string, string> = { success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "\u2022" };

export function Goals({ page, data, now }: { page: Page; data: RunState; now: number }) {
  const [all, setAll] = useState(false);
  const goals = Object.entries(data.goals).sort(([, a], [, b]) => (b.ended ?? b.since) - (a.ended ?? a.since));
  const running = goals.filter(([, goal]) => goal.ended == null).slice(0, MOST);
  const ended = goals.filter(([, goal]) => goal.ended != null && (all || now - goal.ended / 1e6 < RECENT_MS));
  const shown = all ? ended : ended.slice(0, MOST_ENDED);
  const left = goals.filter(([, goal]) => goal.ended != null).length - shown.length;
  return (
    <Section title="Goals">
      {!goals.length && <p class="hint">none</p>}
      {running.map(([id, goal]) => (
        <Goal key={id} id={id} goal={goal} now={now} page={page} />
      ))}
      {shown.map(([id, goal]) => (
        <EndedGoal key={id} id={id} goal={goal} page={page} />
      ))}
      {left > 0 && (
        <button class="small" onClick={() => setAll(true)}>
          {left} earlier
        </button>
      )}
    </Section>
  );
}

/** An ended goal on one line, which can be opened. */
function EndedGoal({ id, goal, page }: { id: string; goal: GoalRun; page: Page }) {
  const [open, setOpen] = useState(false);
  const kind = outcomeClass(goal.status);
  const took = duration(((goal.ended ?? goal.since) - goal.since) / 1e9);
  const status = goal.status.toLowerCase();
  const onClick = (e: MouseEvent) => (e.target as Element).closest(".link") || setOpen(!open);
  const title = [`${status}: ${goal.action}`, goal.text, id].filter(Boolean).join("\n");
  return (
    <div {...linked(goal, `ended-goal ${kind}`)}>
      <div class="line" title={title} onClick={onClick}>
        <button class={`ended ${kind}`} aria-label={status} aria-expanded={open}>
          {MARKS[kind]}
        </button>
        <StateLink path={goal.path} page={page} />
        <span class="what">{[purposeText(id, goal), goal.text || status].filter(Boolean).join(" ")}</span>
        <span class="times">{took}</span>
      </div>
      {open && (
        <>
          <p class="hint">
            {goal.action}: {status}
            {(goal.attempt ?? 1) > 1 ? `, attempt ${goal.attempt}` : ""}
          </p>
          <pre>
            goal: {pretty(goal.goal)}
            {"\n"}result: {pretty(goal.result)}
          </pre>
        </>
      )}
    </div>
  );
}

function Goal({ id, goal, now, page }: { id: string; goal: GoalRun; now: number; page: Page }) {
  const waits = store.status.hasNoServer(goal);
  const kind = waits ? "waiting" : "active";
  const part = goal.progress?.fraction ?? null;
  const took = duration((now - goal.since / 1e6) / 1000);
  return (
    <div {...linked(goal, `goal ${kind}`)} title={id}>
      <div class="head">
        <StateLink path={goal.path} page={page} />
        <span class="action">{[goal.action, purposeText(id, goal)].filter(Boolean).join(" ")}</span>
        <span class="times">
          {(goal.attempt ?? 1) > 1 ? `attempt ${goal.attempt} \u00b7 ` : ""}
          {took}
        </span>
      </div>
      <ProgressBar part={part} ended={false} />
      <div class="text">
        <Pill kind={kind}>{waits ? "no server seen" : "active"}</Pill> {goal.text || progressText(goal.progress)}
        {part !== null && <span class="times">{Math.round(part * 100)} %</span>}
      </div>
      <Foldable label="goal" value={goal.goal} />
    </div>
  );
}

/** Where a goal leads, or what it is about, behind another word; "" if that is not known. */
const purposeText = (id: string, goal: GoalRun) => {
  const purpose = purposeOf(id, goal);
  return purpose && `\u2192 ${purpose}`;
};

/** Attributes of a row that is highlighted with the visit that sent its goal. */
const linked = (goal: GoalRun, kind: string) => ({
  ...store.pointer.hoverHandlers(goal.path, goal.since / 1e6),
  class: `${kind} ${store.pointer.isLit(goal.path, goal.since / 1e6) ? "lit" : ""}`,
});

const progressText = (progress: Progress | undefined) => {
  const distance = progress?.distance != null ? `${progress.distance.toFixed(2)} m left` : "";
  return [distance, progress?.text].filter(Boolean).join(" \u00b7 ");
};

export function ProgressBar({ part, ended }: { part: number | null; ended: boolean }) {
  const percent = Math.round((part ?? (ended ? 1 : 0)) * 100);
  return (
    <div
      class={`bar ${part === null && !ended ? "unknown" : ""}`}
      role="progressbar"
      aria-label="progress"
      aria-valuemin={0}
      aria-valuemax={100}
      aria-valuenow={part === null ? undefined : percent}
    >
      <i style={{ width: `${percent}%` }} />
    </div>
  );
}

/** A value that is formatted only when it is opened. */
function Foldable({ label, value }: { label: string; value: unknown }) {
  const [open, setOpen] = useState(false);
  if (value == null) return null;
  const onToggle = (e: Event) => setOpen((e.target as HTMLDetailsElement).open);
  return (
    <details open={open} onToggle={onToggle}>
      <summary>{label}</summary>
      {open && <pre>{pretty(value)}</pre>}
    </details>
  );
}
