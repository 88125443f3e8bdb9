// The selected state: its kind, visits, userdata keys, transitions and commands.
import { own } from "#core/fold.js";
import { KIND_NAMES } from "#core/model.js";
import { endClass } from "#core/outcomes.js";
import * as store from "#core/store.js";
import { duration, shorten } from "#core/text.js";
import { OutcomeBreakpoint, StateControls } from "#panels/controls.js";
import { html, Pill, Section } from "#panels/html.js";

/** @typedef {import("#core/model.js").Model} Model */

/** @param {{ data: RunState, now: number, model: Model }} props */
export function SelectedState({ data, now, model }) {
  const node = model.get(store.selected.value);
  if (!node) return null;
  const state = own(data.states, node.path);
  return html`<${Section} title=${node.name}>
    ${node.doc && html`<p class="doc">${node.doc}</p>`}
    <dl class="facts">
      ${factsOf(node, state, now).map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}
      <${Keys} keys=${model.keys[node.path]} />
    </dl>
    ${state?.error && html`<p class="error">${shorten(state.error, 2000)}</p>`}
    <ul class="outcomes">${node.outcomes.map(
      (outcome) =>
        html`<${Outcome} node=${node} outcome=${outcome} times=${own(state?.outcomes, outcome)} model=${model} />`,
    )}</ul>
    <${StateControls} node=${node} state=${state} />
  <//>`;
}

/**
 * @param {StateNode} node
 * @param {StateRun | undefined} state
 * @param {number} now
 * @returns {[string, string | number][]}
 */
function factsOf(node, state, now) {
  const running = state?.since != null ? (now - state.since / 1e6) / 1000 : null;
  const recorded = own(store.statistics.value?.states, node.path);
  /** @type {[string, string | number][]} */
  const facts = [["kind", `${KIND_NAMES[node.kind] ?? node.kind} (${node.type_name})`], ...node.details];
  facts.push(["visits", state?.visits ?? 0]);
  if (state?.visits) facts.push(["time inside", duration(state.seconds + (running ?? 0))]);
  if (running !== null) facts.push(["running for", duration(running)]);
  if (state?.attempt && state.attempt > 1) facts.push(["attempt", state.attempt]);
  if (recorded) facts.push(["recorded runs", recordedText(recorded)]);
  return facts;
}

/** @param {StateStatistics} recorded */
function recordedText({ median, p95, failures, visits }) {
  const times = `median ${duration(median ?? 0)}, 95 % under ${duration(p95 ?? 0)}`;
  return `${times}, ${Math.round(failures * 100)} % failed of ${visits}`;
}

/**
 * The userdata keys of a state, with their names in the container if remapped.
 * @param {{ keys: MachinePayload["keys"][string] | undefined }} props
 */
function Keys({ keys }) {
  if (!keys) return null;
  const outside = new Map(keys.remapping);
  const key = (/** @type {string} */ name) => {
    const other = outside.get(name);
    return html`<code>${name}${other !== undefined && other !== name ? ` \u2190 ${other}` : ""}</code> `;
  };
  return html`
    ${keys.inputs.length > 0 && html`<dt>reads</dt><dd>${keys.inputs.map(key)}</dd>`}
    ${keys.outputs.length > 0 && html`<dt>writes</dt><dd>${keys.outputs.map(key)}</dd>`}`;
}

/** @param {{ node: StateNode, outcome: string, times: number | undefined, model: Model }} props */
function Outcome({ node, outcome, times, model }) {
  const link = model.linkOf(node, outcome);
  return html`<li>
    <${OutcomeBreakpoint} node=${node} outcome=${outcome} />
    <${Pill} kind=${endClass(node, outcome)}>${shorten(outcome, 60)}<//>
    <span>${link ? ` \u2192 ${shorten(link.target)}` : ""}</span>
    <span class="times">${times ? `\u00d7${times}` : ""}</span></li>`;
}
