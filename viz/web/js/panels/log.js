// The log: events as lines, newest first; a click on a line goes to its instant.
import { useState } from "preact/hooks";
import { ms } from "#core/fold.js";
import { KINDS_OF, lineOf } from "#core/log_lines.js";
import * as store from "#core/store.js";
import { countOfEvents, shorten } from "#core/text.js";
import { fieldValue, html, Section, StateLink } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const LINES = 70; // lines at first, and further ones with each click on "older"
const LOOKED_AT = 6000; // events that are searched for these lines
const LONGEST = 200; // characters

/** @param {{ page: Page }} props */
export function Log({ page }) {
  store.slowTick.value;
  const [text, setText] = useState("");
  const [pages, setPages] = useState(1);
  const end = store.eventsShown();
  const first = Math.max(0, end - pages * LOOKED_AT);
  const begun = ms(store.shown().started) ?? store.run.first() ?? 0;
  const most = pages * LINES;
  const wanted = text.toLowerCase();
  const kinds = KINDS_OF[store.logFilter.value];
  const lines = [];
  let i = end - 1;
  for (; i >= first && lines.length < most; i--) {
    const e = store.run.events[i];
    const missing = i + 1 < end ? (store.run.events[i + 1].dropped ?? 0) : 0;
    if (missing) lines.push(html`<li key=${-e.seq} class="hint">${countOfEvents(missing)} missing here</li>`);
    if (!kinds.has(e.kind)) continue;
    const line = lineOf(e, store.model.value?.get(e.path));
    if (wanted && !`${e.path} ${line.text}`.toLowerCase().includes(wanted)) continue;
    const count = i + 1;
    const onClick = () => {
      if (store.cursor.value !== null) store.seekTo(count);
    };
    const t = e.stamp_ns / 1e6;
    lines.push(html`<li key=${e.seq} class=${store.isLit(e.path, t) ? "lit" : ""} onClick=${onClick}
        ...${store.hoverHandlers(e.path, t)}>
      <time>${((e.stamp_ns / 1e6 - begun) / 1000).toFixed(2)}</time>
      <${StateLink} path=${e.path} page=${page} />${" "}
      <span class=${`word ${line.kind}`}>${shorten(line.text, LONGEST)}</span>${targetOf(e)}</li>`);
  }
  const all = end.toLocaleString("en");
  const nothing = `nothing more in the last ${(end - first).toLocaleString("en")} of ${all} events; look at older ones`;
  return html`<${Section} title="Log">
    <div class="filter">
      <select aria-label="kinds" value=${store.logFilter.value} onChange=${chooseKinds}>
        ${Object.keys(KINDS_OF).map((name) => html`<option value=${name}>${name}</option>`)}</select>
      <input aria-label="filter the log" placeholder="filter" value=${text}
        onInput=${(/** @type {Event} */ e) => setText(fieldValue(e))} />
    </div>
    <ol class="log">${lines}</ol>
    ${
      i >= 0 &&
      html`<button class="small" onClick=${() => setPages(pages + 1)}>
        ${lines.length < most ? nothing : "older"}</button>`
    }<//>`;
}

/** @param {Event} e */
const chooseKinds = (e) => {
  store.logFilter.value = fieldValue(e);
};

/** The target of a transition, unless its outcome has the same name. @param {RunEvent} e */
function targetOf(e) {
  const node = e.kind === "Left" ? store.model.value?.get(e.path) : undefined;
  const link = node && store.model.value?.linkOf(node, e.outcome);
  return link && link.target !== e.outcome ? ` \u2192 ${shorten(link.target)}` : "";
}
