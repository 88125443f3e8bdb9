// The dialog for simulated runs: starts batches, shows their progress and reports.
import { useEffect, useState } from "preact/hooks";
import { askSimulation, encoded, hasToken, refreshSimulations } from "#core/connection.js";
import { outcomeClass } from "#core/outcomes.js";
import { beganText } from "#core/run_list.js";
import { doneOf, startOf } from "#core/simulations.js";
import * as store from "#core/store.js";
import { shorten } from "#core/text.js";
import { fieldValue, html, Pill } from "#panels/html.js";

const REFRESH_MS = 1000;
/** @type {import("#core/simulations.js").Form} */
const FORM = { mission: "", runs: "20", vary: "", seed: "1", limit: "4h", compare: "" };

export const SimulateDialog = () => (store.simulateOpen.value ? html`<${OpenDialog} />` : null);

function OpenDialog() {
  const [form, setForm] = useState(FORM);
  const [problems, setProblems] = useState("");
  const { missions, batches } = store.simulations.value;
  const names = Object.keys(missions);
  const mission = form.mission || names[0] || "";
  useEffect(() => {
    refreshSimulations();
    const timer = setInterval(refreshSimulations, REFRESH_MS);
    return () => clearInterval(timer);
  }, []);
  const close = () => {
    store.simulateOpen.value = false;
  };
  const onSubmit = async (/** @type {Event} */ e) => {
    e.preventDefault();
    const { asked, problem } = startOf({ ...form, mission });
    setProblems(problem);
    if (!asked) return;
    const answer = await askSimulation(asked);
    setProblems(answer.ok ? "" : (answer.text ?? "refused"));
  };
  /** @type {(name: keyof typeof FORM) => (e: Event) => void} */
  const change = (name) => (e) => setForm({ ...form, [name]: fieldValue(e) });
  const earlier = batches.filter((one) => one.mission === mission && !one.running && one.report);
  const onKeyDown = (/** @type {KeyboardEvent} */ e) => {
    if (e.key === "Escape") close();
    e.stopPropagation(); // no shortcuts while typing in the form
  };
  return html`<div class="veil" onKeyDown=${onKeyDown}>
    <div class="card simulate" role="dialog" aria-label="simulated runs">
    <header><h2>Simulated runs</h2><button onClick=${close} aria-label="close">Close</button></header>
    ${
      hasToken()
        ? html`<form onSubmit=${onSubmit}>
      <label>Mission <select value=${mission} onChange=${change("mission")}>
        ${names.map((name) => html`<option value=${name}>${name}</option>`)}</select></label>
      <label>Runs <input inputmode="numeric" value=${form.runs} onInput=${change("runs")} /></label>
      <label>Seed <input inputmode="numeric" value=${form.seed} onInput=${change("seed")} /></label>
      <label>Limit of a run <input value=${form.limit} onInput=${change("limit")} /></label>
      <label class="wide">Varied values, one per line
        <textarea rows="2" placeholder="battery=0.2..1.0" spellcheck=${false} value=${form.vary}
          onInput=${change("vary")}></textarea></label>
      <label class="wide">Compare with <select value=${form.compare} onChange=${change("compare")}>
        <option value="">nothing</option>${earlier.map(
          (one) => html`<option value=${one.id}>${one.runs} runs of ${beganText(one.began_ns, new Date())}</option>`,
        )}</select></label>
      ${problems && html`<p class="problem wide">${problems}</p>`}
      <p class="wide"><button class="primary" type="submit">Start</button>
        <span class="hint">${shorten(missions[mission] ?? "", 90)}</span></p></form>`
        : html`<p class="hint">Only a viewer with --control can start runs, at its address with the token.</p>`
    }
    <ul class="batches">${batches.map((one) => html`<${BatchRow} key=${one.id} batch=${one} />`)}</ul>
  </div></div>`;
}

/** @param {{ batch: Batch }} props */
function BatchRow({ batch }) {
  const { id, mission, runs, running, outcomes, failed, problem, report, vary } = batch;
  const done = doneOf(batch);
  const why = problem || batch.first_failure;
  const stop = () => askSimulation({ command: "stop", batch: id });
  return html`<li><div><b>${shorten(mission, 40)}</b> <span class="hint">${beganText(batch.began_ns, new Date())}${
    vary.length > 0 && `, ${shorten(vary.join(", "), 60)}`
  }</span></div>
    <div>${running ? html`<progress max=${runs} value=${done}></progress> ${done} of ${runs} ` : `${done} runs `}
      ${Object.entries(outcomes).map(
        ([outcome, count]) => html`<${Pill} kind=${outcomeClass(outcome)}>${shorten(outcome, 20)} \u00d7${count}<//> `,
      )}
      ${failed > 0 && html`<${Pill} kind="failure">no end \u00d7${failed}<//> `}
      ${running && hasToken() && html`<button class="small" aria-label=${`stop ${id}`} onClick=${stop}>Stop</button>`}
      ${
        report &&
        html`<a href=${`/api/report?batch=${encoded(id)}`} target="_blank" rel="noopener noreferrer"
        aria-label=${`report of ${id}`}>Report</a>`
      }</div>
    ${why && html`<small class="problem">${shorten(why, 200)}</small>`}
  </li>`;
}
