// The panel beside the diagram: questions, the selected state, preempts, goals, userdata, numbers, problems, the log.
import * as store from "#core/store.js";
import { countOfEvents, shorten } from "#core/text.js";
import { Differences } from "#panels/comparison.js";
import { Goals } from "#panels/goals.js";
import { html, StateLink } from "#panels/html.js";
import { Log } from "#panels/log.js";
import { Notes } from "#panels/notes.js";
import { Numbers } from "#panels/numbers.js";
import { Preempts } from "#panels/preempts.js";
import { Questions } from "#panels/questions.js";
import { SelectedState } from "#panels/selected_state.js";
import { Changes, Userdata } from "#panels/userdata.js";
import { WhyPanel } from "#panels/why.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const MOST_PROBLEMS = 30;

/** @param {{ page: Page }} props */
export function Inspector({ page }) {
  store.slowTick.value; // read, so that this component is drawn again when the signal changes
  const model = store.model.value;
  if (!model) return html`<aside class="inspector"><${Questions} page=${page} /></aside>`;
  const shared = { page, data: store.shown(), now: store.nowMs() };
  return html`<aside class="inspector" aria-label="details">
    <${Questions} page=${page} />
    <${MissingEvents} dropped=${shared.data.dropped ?? 0} />
    <${WhyPanel} page=${page} />
    <${SelectedState} ...${shared} model=${model} />
    <${Differences} page=${page} />
    <${Preempts} ...${shared} />
    <${Notes} />
    <${Goals} ...${shared} />
    <${Userdata} ...${shared} />
    <${Changes} page=${page} />
    <${Numbers} />
    <${Problems} page=${page} />
    <${Log} page=${page} />
  </aside>`;
}

/** @param {{ dropped: number }} props */
function MissingEvents({ dropped }) {
  const gap = store.gap.value;
  return html`
    ${
      gap !== null &&
      html`<p class="hint gap" role="status">This page missed ${countOfEvents(gap)}. They and all before them are
        counted, but not in the timeline.</p>`
    }
    ${
      dropped > 0 &&
      html`<p class="hint gap" role="status">Events came faster than they could be sent: ${countOfEvents(dropped)} are
        missing, so all counts are too low.</p>`
    }`;
}

/** @param {{ page: Page }} props */
function Problems({ page }) {
  const found = store.problems.value;
  if (!found.length) return null;
  const text = (/** @type {Problem} */ one) =>
    shorten(one.text.startsWith(`${one.path}: `) ? one.text.slice(one.path.length + 2) : one.text, 600);
  return html`<section><details class="fold-up">
    <summary><h2>Problems of the machine <span class="number">${found.length}</span></h2></summary>
    <ul class="problems">${found
      .slice(0, MOST_PROBLEMS)
      .map(
        (one) => html`<li class=${one.severity}><${StateLink} path=${one.path} page=${page} /> ${text(one)}</li>`,
      )}</ul>
  </details></section>`;
}
