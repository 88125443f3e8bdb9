// The totals of the numbers in the diagram.
import { outcomeClass } from "#core/outcomes.js";
import { coverage } from "#core/statistics.js";
import * as store from "#core/store.js";
import { duration } from "#core/text.js";
import { html, Pill, Section } from "#panels/html.js";

export function Numbers() {
  store.slowTick.value;
  if (store.numbers.value === "none") return null;
  const { taken, all } = coverage(store.model.value, store.shown().states);
  const recorded = store.statistics.value;
  return html`<${Section} title="Numbers"><dl class="facts">
    <dt>transitions taken</dt><dd>${taken} of ${all} (${all ? Math.round((taken / all) * 100) : 0} %)</dd>
    ${
      recorded &&
      html`<dt>recorded runs</dt><dd>${recorded.runs}, median ${duration(recorded.median ?? 0)}</dd>
        <dt>they ended</dt><dd>${Object.entries(recorded.outcomes).map(
          ([outcome, times]) => html`<${Pill} kind=${outcomeClass(outcome)}>${outcome} \u00d7${times}<//>${" "}`,
        )}</dd>`
    }
  </dl><//>`;
}
