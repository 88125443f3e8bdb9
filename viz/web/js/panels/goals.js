// The goals sent by the machine.
import { useState } from "preact/hooks";
import { outcomeClass } from "#core/outcomes.js";
import * as store from "#core/store.js";
import { duration } from "#core/text.js";
import { pretty } from "#core/values.js";
import { html, Pill, Section, StateLink } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const RECENT_MS = 60_000; // time for which an ended goal is shown
const MOST = 6; // running goals that are shown
const MOST_ENDED = 3;
/** @type {Record<string, string>} */
const MARKS = { success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "\u2022" };

/** @param {{ page: Page, data: RunState, now: number }} props */
export function Goals({ page, data, now }) {
  const [all, setAll] = useState(false);
  const goals = Object.entries(data.goals).sort(([, a], [, b]) => (b.ended ?? b.since) - (a.ended ?? a.since));
  const running = goals.filter(([, goal]) => goal.ended == null).slice(0, MOST);
  const ended = goals.filter(([, goal]) => goal.ended != null && (all || now - goal.ended / 1e6 < RECENT_MS));
  const shown = all ? ended : ended.slice(0, MOST_ENDED);
  const left = goals.filter(([, goal]) => goal.ended != null).length - shown.length;
  return html`<${Section} title="Goals">
    ${!goals.length && html`<p class="hint">none</p>`}
    ${running.map(([id, goal]) => html`<${Goal} key=${id} id=${id} goal=${goal} now=${now} page=${page} />`)}
    ${shown.map(([id, goal]) => html`<${EndedGoal} key=${id} id=${id} goal=${goal} page=${page} />`)}
    ${left > 0 && html`<button class="small" onClick=${() => setAll(true)}>${left} earlier</button>`}
  <//>`;
}

/** An ended goal on one line, which can be opened. @param {{ id: string, goal: GoalRun, page: Page }} props */
function EndedGoal({ id, goal, page }) {
  const [open, setOpen] = useState(false);
  const kind = outcomeClass(goal.status);
  const took = duration(((goal.ended ?? goal.since) - goal.since) / 1e9);
  const status = goal.status.toLowerCase();
  const onToggle = (/** @type {Event} */ e) => setOpen(/** @type {HTMLDetailsElement} */ (e.target).open);
  const title = [`${status}: ${goal.action}`, goal.text, id].filter(Boolean).join("\n");
  return html`<details ...${linked(goal, `ended-goal ${kind}`)} open=${open} onToggle=${onToggle}>
    <summary title=${title}><span class=${`ended ${kind}`} aria-label=${status}>${MARKS[kind]}</span>
      <${StateLink} path=${goal.path} page=${page} /><span class="what">${goal.text || status}</span>
      <span class="times">${took}</span></summary>
    ${
      open &&
      html`<p class="hint">${goal.action}: ${status}${goal.attempt > 1 ? `, attempt ${goal.attempt}` : ""}</p>
      <pre>${pretty({ goal: goal.goal, result: goal.result })}</pre>`
    }</details>`;
}

/** @param {{ id: string, goal: GoalRun, now: number, page: Page }} props */
function Goal({ id, goal, now, page }) {
  const waits = store.hasNoServer(goal);
  const kind = waits ? "waiting" : "active";
  const part = goal.progress?.fraction ?? null;
  const took = duration((now - goal.since / 1e6) / 1000);
  return html`<div ...${linked(goal, `goal ${kind}`)} title=${id}>
    <div class="head"><${StateLink} path=${goal.path} page=${page} /><span class="action">${goal.action}</span>
      <span class="times">${goal.attempt > 1 ? `attempt ${goal.attempt} \u00b7 ` : ""}${took}</span></div>
    <${ProgressBar} part=${part} ended=${false} />
    <div class="text"><${Pill} kind=${kind}>${waits ? "no server seen" : "active"}<//>${" "}
      ${goal.text || progressText(goal.progress)}
      ${part !== null && html`<span class="times">${Math.round(part * 100)} %</span>`}</div>
    <${Foldable} label="goal" value=${goal.goal} /></div>`;
}

/**
 * Attributes of a row that is highlighted with the visit that sent its goal.
 * @param {GoalRun} goal @param {string} kind
 */
const linked = (goal, kind) => ({
  ...store.hoverHandlers(goal.path, goal.since / 1e6),
  class: `${kind} ${store.isLit(goal.path, goal.since / 1e6) ? "lit" : ""}`,
});

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

/** A value that is formatted only when it is opened. @param {{ label: string, value: unknown }} props */
function Foldable({ label, value }) {
  const [open, setOpen] = useState(false);
  if (value == null) return null;
  const onToggle = (/** @type {Event} */ e) => setOpen(/** @type {HTMLDetailsElement} */ (e.target).open);
  return html`<details open=${open} onToggle=${onToggle}>
    <summary>${label}</summary>${open && html`<pre>${pretty(value)}</pre>`}</details>`;
}
