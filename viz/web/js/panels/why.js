// The causes of the run's end, from the first one to the outcome; a click on a step goes to its instant.
import { showWhy } from "#core/connection.js";
import * as store from "#core/store.js";
import { html, Section } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

/** @param {{ page: Page }} props */
export function WhyPanel({ page }) {
  const why = store.why.value;
  if (!why) return null;
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(why.text);
      store.notify("Copied");
    } catch {
      store.notify("This browser lets no page copy here: mark the text and copy it", "error");
    }
  };
  const title = why.outcome === null ? "Why has it no end?" : "Why did it end so?";
  return html`<${Section} title=${title}><div class="why">
    <span class="why-tools"><button class="small" onClick=${copy}>Copy as text</button>
      <button class="small" aria-label="close" onClick=${() => showWhy(false)}>\u2715</button></span>
    ${!why.steps.length && html`<p class="hint">the causes are unknown</p>`}
    <ol>${why.steps.map(
      (step, i) => html`<${Step} step=${step} began=${why.began ?? 0} first=${i === 0} page=${page} />`,
    )}</ol></div><//>`;
}

/** @param {{ step: WhyStep, began: number, first: boolean, page: Page }} props */
function Step({ step, began, first, page }) {
  const goThere = () => {
    store.seek(step.stamp_ns / 1e6);
    page.goTo(step.path);
  };
  return html`<li class=${`${step.kind} ${first ? "first" : ""}`}>
    <button class="step" title=${step.path} onClick=${goThere}>
      <b>${store.nameOf(step.path)}</b> <span class=${`word ${step.kind}`}>${step.what}</span>${" "}
      <time>${((step.stamp_ns - began) / 1e9).toFixed(2)}</time></button>
    ${step.reason && html`<p>${step.reason}</p>`}
    ${step.detail && html`<pre>${step.detail}</pre>`}
    ${step.written.map(
      ([key, value, before]) =>
        html`<p>wrote <b>${key}</b> ${value}${before && html` <small>(was ${before})</small>`}</p>`,
    )}</li>`;
}
