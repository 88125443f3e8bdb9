// Two machines, or two runs, in one drawing: what was added, removed, changed.
import { h } from "preact";
import { useState } from "preact/hooks";
import htm from "htm";
import * as store from "viewer/store";
import { SIGNS, shorten } from "viewer/model";
import { ask, encoded, isFile, link } from "viewer/source";

const html = htm.bind(h);
const MOST = 60;

// Show this machine together with the one of that name; null: alone again.
export async function compare(page, name) {
  if (!name) {
    if (!store.comparison.value) return;
    const { alone } = store.comparison.value;
    store.comparison.value = null;
    show(page, alone);
    return;
  }
  const asked = store.facts.value?.name;
  const found = await ask(link("compare", `&with=${encoded(name)}`));
  if (asked !== store.facts.value?.name) return; // another machine has been chosen
  if (!found.model) { store.say(found.text ?? "cannot be compared", "error"); return; }
  const alone = store.comparison.value?.alone ?? store.model.value.payload;
  store.comparison.value = { ...found, alone };
  show(page, found.model);
}

function show(page, payload) {
  const opened = store.opened.value;
  store.setModel(payload);
  store.keepOpened(new Set([...opened].filter((path) => store.model.value.get(path)?.children.length)));
  page.select(null);
  page.layout.forget();
  page.relayout({ frame: true });
}

export function CompareLine({ page, done }) {
  const facts = store.facts.value, others = store.machines.value.filter((m) => m.name !== facts?.name);
  if (isFile() || !store.model.value) return null;
  return html`<label class="line"><span>Compare with</span><select id="compare" value=${store.comparison.value?.with ?? ""} disabled=${!others.length}
      title=${others.length ? "" : "no other machine or recording here; try: smachpy view old.jsonl new.jsonl"}
      onChange=${(e) => { compare(page, e.target.value); done(); }}>
      <option value="">${others.length ? "nothing" : "nothing else here"}</option>${others.map((m) => html`<option value=${m.name}>${m.name}</option>`)}</select></label>`;
}

export function CompareChip({ page }) {
  const found = store.comparison.value;
  if (!found) return null;
  return html`<button class="chip compare-chip" title="show it alone again" onClick=${() => compare(page, null)}>compared with ${found.with} \u2715</button>`;
}

export function Differences({ page, State }) {
  const found = store.comparison.value;
  const [all, setAll] = useState(false);
  if (!found) return null;
  const shown = all ? found.listed : found.listed.slice(0, MOST);
  return html`<section><h2>Differences <span class="number">${found.listed.length}</span></h2>
    <p class="hint">from ${found.with}${found.runs.every(Boolean) ? ` (${found.runs[0]} runs) to this (${found.runs[1]}); \u00d7: visits per run` : ""}</p>
    ${!found.listed.length && html`<p class="hint">no notable difference</p>`}
    <ul class="differences">${shown.map((one) => html`<li class=${one.change}><b aria-hidden="true">${SIGNS[one.change]}</b><span><${State} path=${one.path} page=${page} />
      <span class="hidden"> ${one.change}</span>${one.text !== one.change ? ` ${shorten(one.text, 300)}` : ""}</span></li>`)}</ul>
    ${shown.length < found.listed.length && html`<button onClick=${() => setAll(true)}>and ${found.listed.length - shown.length} more</button>`}</section>`;
}
