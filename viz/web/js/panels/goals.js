// The goals that the machine has sent.
import { useState } from "preact/hooks";
import { ms } from "#core/fold.js";
import { outcomeClass } from "#core/outcomes.js";
import * as store from "#core/store.js";
import { duration } from "#core/text.js";
import { pretty } from "#core/values.js";
import { html, Pill, Section, StateLink } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const RECENT_MS = 60_000; // a goal that has ended is shown so long
const MOST = 6;

/** @param {{ page: Page, data: RunState, now: number }} props */
export function Goals({ page, data, now }) {
  const goals = Object.entries(data.goals)
    .filter(([, goal]) => goal.ended == null || now - goal.ended / 1e6 < RECENT_MS)
    .sort(([, a], [, b]) => (b.ended ?? Infinity) - (a.ended ?? Infinity) || b.since - a.since)
    .slice(0, MOST);
  return html`<${Section} title="Goals">
    ${!goals.length && html`<p class="hint">none</p>`}
    ${goals.map(([id, goal]) => html`<${Goal} key=${id} id=${id} goal=${goal} now=${now} page=${page} />`)}
  <//>`;
}

/** @param {{ id: string, goal: GoalRun, now: number, page: Page }} props */
function Goal({ id, goal, now, page }) {
  const ended = goal.ended != null;
  const waits = store.hasNoServer(goal);
  const kind = ended ? outcomeClass(goal.status) : waits ? "waiting" : "active";
  const status = ended ? goal.status.toLowerCase() : waits ? "no server seen" : "active";
  const part = goal.status === "SUCCEEDED" ? 1 : (goal.progress?.fraction ?? null);
  const took = duration(((ms(goal.ended) ?? now) - goal.since / 1e6) / 1000);
  return html`<div class=${`goal ${kind}`} title=${id}>
    <div class="head"><${StateLink} path=${goal.path} page=${page} /><span class="action">${goal.action}</span>
      <span class="times">${goal.attempt > 1 ? `attempt ${goal.attempt} \u00b7 ` : ""}${took}</span></div>
    <${ProgressBar} part=${part} ended=${ended} />
    <div class="text"><${Pill} kind=${kind}>${status}<//>${" "}${goal.text || progressText(goal.progress)}
      ${part !== null && !ended && html`<span class="times">${Math.round(part * 100)} %</span>`}</div>
    <${Foldable} label="goal" value=${goal.goal} /></div>`;
}

/** @param {Progress | undefined} progress */
const progressText = (progress) => {
  const distance = progress?.distance != null ? `${progress.distance.toFixed(2)} m left` : "";
  return [distance, progress?.text].filter(Boolean).join(" \u00b7 ");
};

/** @param {{ part: number | null, ended: boolean }} props */
export function ProgressBar({ part, ended }) {
  const percent = Math.round((part ?? (ended ? 1 : 0)) * 100);
  return html`<div class=${`bar ${part === null && !ended ? "unknown" : ""}`} role="progressbar" aria-label="progress"
    aria-valuemin="0" aria-valuemax="100" aria-valuenow=${part === null ? undefined : percent}>
    <i style=${{ width: `${percent}%` }}></i></div>`;
}

/** A value that is written out only when it is looked at. @param {{ label: string, value: unknown }} props */
function Foldable({ label, value }) {
  const [open, setOpen] = useState(false);
  if (value == null) return null;
  const onToggle = (/** @type {Event} */ e) => setOpen(/** @type {HTMLDetailsElement} */ (e.target).open);
  return html`<details open=${open} onToggle=${onToggle}>
    <summary>${label}</summary>${open && html`<pre>${pretty(value)}</pre>`}</details>`;
}
