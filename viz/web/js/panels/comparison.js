// Two machines, or two runs, in one drawing, with what was added, removed and changed.
import { useState } from "preact/hooks";
import { ask, encoded, isFile, link } from "#core/connection.js";
import { CHANGE_SIGNS } from "#core/model.js";
import * as store from "#core/store.js";
import { shorten } from "#core/text.js";
import { fieldValue, html, More, StateLink } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const MOST = 60; // differences that are listed at first

/** Compare the machine shown with another one; "" ends the comparison. @param {Page} page @param {string} name */
async function compare(page, name) {
  if (!name) {
    if (!store.comparison.value) return;
    const { alone } = store.comparison.value;
    store.comparison.value = null;
    show(page, alone);
    return;
  }
  const asked = store.facts.value?.name;
  const found = await ask(link("compare", `&with=${encoded(name)}`));
  const model = store.model.value;
  if (!model || asked !== store.facts.value?.name) return; // another machine was chosen meanwhile
  if (!found.model) {
    store.notify(found.text ?? "cannot be compared", "error");
    return;
  }
  const alone = store.comparison.value?.alone ?? model.payload;
  store.comparison.value = /** @type {Comparison} */ ({ ...found, alone });
  show(page, found.model);
}

/** @param {Page} page @param {MachinePayload} payload */
function show(page, payload) {
  const opened = store.opened.value;
  store.setModel(payload);
  store.keepOpened(new Set([...opened].filter((path) => store.model.value?.get(path)?.children.length)));
  page.select(null);
  page.layout?.forget();
  page.relayout({ frame: true });
}

/** @param {{ page: Page, onDone: () => void }} props */
export function CompareLine({ page, onDone }) {
  const others = store.machines.value.filter((machine) => machine.name !== store.facts.value?.name);
  if (isFile() || !store.model.value) return null;
  const title = others.length ? "" : "no other machine or recording here; try: smachpy view old.jsonl new.jsonl";
  const choose = (/** @type {Event} */ e) => {
    compare(page, fieldValue(e));
    onDone();
  };
  return html`<label class="line"><span>Compare with</span>
    <select id="compare" value=${store.comparison.value?.with ?? ""} disabled=${!others.length} title=${title}
      onChange=${choose}>
      <option value="">${others.length ? "nothing" : "nothing else here"}</option>
      ${others.map(({ name }) => html`<option value=${name}>${name}</option>`)}
    </select></label>`;
}

/** @param {{ page: Page }} props */
export function CompareChip({ page }) {
  const found = store.comparison.value;
  if (!found) return null;
  return html`<button class="chip compare-chip" title="show it alone again" onClick=${() => compare(page, "")}>
    compared with ${found.with} \u2715</button>`;
}

/** @param {{ page: Page }} props */
export function Differences({ page }) {
  const found = store.comparison.value;
  const [all, setAll] = useState(false);
  if (!found) return null;
  const shown = all ? found.listed : found.listed.slice(0, MOST);
  const [before, now] = found.runs;
  const runs = before && now ? ` (${before} runs) to this (${now}); \u00d7: visits per run` : "";
  return html`<section>
    <h2>Differences <span class="number">${found.listed.length}</span></h2>
    <p class="hint">from ${found.with}${runs}</p>
    ${!found.listed.length && html`<p class="hint">no notable difference</p>`}
    <ul class="differences">${shown.map((one) => html`<${Difference} one=${one} page=${page} />`)}</ul>
    <${More} left=${found.listed.length - shown.length} onMore=${() => setAll(true)} />
  </section>`;
}

/** @param {{ one: Comparison["listed"][number], page: Page }} props */
const Difference = ({ one, page }) => html`<li class=${one.change}>
  <b aria-hidden="true">${CHANGE_SIGNS[one.change]}</b>
  <span><${StateLink} path=${one.path} page=${page} /><span class="hidden"> ${one.change}</span>
    ${one.text !== one.change ? ` ${shorten(one.text, 300)}` : ""}</span></li>`;
