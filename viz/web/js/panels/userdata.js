// The userdata of all containers, and the changes by a transition.
import { signal } from "@preact/signals";
import { useState } from "preact/hooks";
import { ask, encoded, isFile, link } from "#core/connection.js";
import { containerOf, ms, own } from "#core/fold.js";
import { parseRepr, rounded } from "#core/repr.js";
import * as store from "#core/store.js";
import { shorten } from "#core/text.js";
import { brief, pretty, wasShortened } from "#core/values.js";
import { html, More, Section, StateLink } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const FRESH_MS = 900; // time for which a written value is highlighted
const MOST_VALUES = 60;
const MOST_CHANGES = 8;
const SHORT = 160; // characters; browsers take minutes to break lines with thousands of them
const CHANGE = 60;
const MOST_ITEMS = 100; // of a list
const LONGEST = 2000; // characters
/** @type {Record<string, string>} */
const BRACKETS = { "[": "list", "(": "tuple", "{": "dict" };
const RUNS = 1e20; // later than any time [ns]

/** @param {{ page: Page, data: RunState, now: number }} props */
export function Userdata({ page, data, now }) {
  /** @type {[string | null, (id: string | null) => void]} */
  const [open, setOpen] = useState(/** @type {string | null} */ (null));
  const [most, setMost] = useState(MOST_VALUES);
  const entries = sorted(data);
  const several = new Set(entries.map(([, entry]) => entry.container)).size > 1;
  const rows = entries.slice(0, most).map(([id, entry], i) => {
    const isFirst = several && entries[i - 1]?.[1].container !== entry.container;
    const onClick = () => setOpen(open === id ? null : id);
    return html`${isFirst && html`<${ContainerRow} path=${entry.container} />`}
      <${Row} key=${id} entry=${entry} open=${open === id} onClick=${onClick} data=${data} now=${now} page=${page} />`;
  });
  return html`<${Section} title="Userdata" count=${entries.length || null}>
    ${!entries.length && html`<p class="hint">nothing written yet</p>`}
    <div class="scroller"><table class="userdata"><tbody>${rows}</tbody></table></div>
    <${More} left=${entries.length - most} onMore=${() => setMost(most + 4 * MOST_VALUES)} /><//>`;
}

/** The containers: running ones first, then by their newest written value. @param {RunState} data */
function sorted(data) {
  const rank = new Map();
  for (const { container, at } of Object.values(data.userdata)) {
    const runs = own(data.states, container)?.since != null;
    rank.set(container, Math.max(rank.get(container) ?? 0, runs ? RUNS : at));
  }
  return Object.entries(data.userdata).sort(
    ([a, one], [b, other]) => rank.get(other.container) - rank.get(one.container) || (a < b ? -1 : 1),
  );
}

/** @param {{ path: string }} props */
function ContainerRow({ path }) {
  const names = path.split("/").filter(Boolean).slice(-2);
  const title = names.map((name) => shorten(name)).join(" \u203a ");
  return html`<tr class="group"><th colspan="2" title=${path}>${title}</th></tr>`;
}

/**
 * @param {{
 *   entry: UserdataEntry, open: boolean, onClick: () => void, data: RunState, now: number, page: Page,
 * }} props
 */
function Row({ entry, open, onClick, data, now, page }) {
  const text = brief(entry.value);
  const short = text.length > SHORT ? `${text.slice(0, SHORT)}\u2026` : text;
  const began = ms(data.started) ?? store.run.first() ?? entry.at / 1e6;
  const at = (entry.at / 1e6 - began) / 1000;
  const isFresh = now - entry.at / 1e6 < FRESH_MS;
  return html`<tr class=${isFresh ? "fresh" : ""} tabindex="0" aria-expanded=${open} onClick=${onClick}
    onKeyDown=${pressAsClick}>
    <th scope="row" title=${shorten(entry.container, 400)}>${shorten(entry.key, 80)}</th>
    <td><code>${open ? html`<${Whole} value=${entry.value} />` : short}</code>
      ${open && wasShortened(text) && html`<${WholeValue} entry=${entry} />`}
      <small>by <${StateLink} path=${entry.writer} page=${page} /> at ${at.toFixed(at < 100 ? 2 : 0)} s</small>
    </td></tr>`;
}

/** A complete value; a repr is shown as a tree. @param {{ value: any }} props */
function Whole({ value }) {
  const tree = typeof value === "string" ? parseRepr(value) : null;
  return tree ? html`<${Branch} tree=${tree} />` : html`<pre>${pretty(value)}</pre>`;
}

/** @param {{ tree: import("#core/repr.js").Branch }} props @returns {any} */
function Branch({ tree }) {
  const item = (/** @type {[string | null, import("#core/repr.js").Tree]} */ [name, value]) =>
    html`<li>${name !== null && html`<b>${shorten(name, 80)}</b> `}${
      typeof value === "string" ? rounded(value).slice(0, LONGEST) : html`<${Branch} tree=${value} />`
    }</li>`;
  const left = tree.items.length - MOST_ITEMS;
  return html`<span>${tree.name in BRACKETS ? BRACKETS[tree.name] : tree.name}</span>
    <ul class="value-tree">${tree.items.slice(0, MOST_ITEMS).map(item)}
      ${left > 0 && html`<li>and ${left} more</li>`}</ul>`;
}

/** Handle Enter and Space on a row like a click. @param {KeyboardEvent} e */
function pressAsClick(e) {
  if (e.target !== e.currentTarget || (e.key !== "Enter" && e.key !== " ")) return;
  e.preventDefault();
  /** @type {HTMLElement} */ (e.currentTarget).click();
}

/** @type {import("@preact/signals").Signal<Record<string, Answer>>} */
const wholeValues = signal({}); // fetched values by container and key; kept here, as rows come and go

/**
 * Fetches a complete value from the mission: events contain only the beginning of a long one.
 * @param {{ entry: UserdataEntry }} props
 */
function WholeValue({ entry }) {
  // Labels can contain slashes, so the container cannot be found in the path.
  const container = store.model.value?.get(entry.writer)?.parent?.path ?? entry.container;
  const id = `${store.facts.value?.epoch} ${container} ${entry.key}`;
  const found = wholeValues.value[id];
  if (isFile() || store.facts.value?.recorded) return html`<small>shortened when it was recorded</small>`;
  const put = (/** @type {Answer} */ answer) => {
    wholeValues.value = { ...wholeValues.value, [id]: answer };
  };
  const fetchIt = async (/** @type {Event} */ e) => {
    e.stopPropagation();
    put({ text: "Asking the mission\u2026" });
    put(await ask(link("value", `&container=${encoded(container)}&key=${encoded(entry.key)}`)));
  };
  if (!found) return html`<button class="small whole" onClick=${fetchIt}>Fetch the whole value</button>`;
  const text = found.text ?? "";
  return html`<div class="whole-value" onClick=${(/** @type {Event} */ e) => e.stopPropagation()}>${
    found.ok
      ? html`<small>as it was when it was asked for, ${text.length.toLocaleString("en")} characters${" "}
          <button class="small" onClick=${fetchIt}>again</button></small>
          <textarea readonly rows="14" wrap="off" aria-label=${`the whole value of ${entry.key}`}
            value=${text}></textarea>`
      : html`<p class="error">${text}</p>`
  }</div>`;
}

/** The changes by the transition at the instant shown. @param {{ page: Page }} props */
export function Changes({ page }) {
  const [whole, setWhole] = useState(false);
  if (store.cursor.value === null) return null;
  const { before, writes } = store.run.lastTransition(store.eventsShown());
  const shown = whole ? writes : writes.slice(-MOST_CHANGES);
  return html`<${Section} title="Changed by this transition">
    ${!writes.length && html`<p class="hint">no userdata was written</p>`}
    ${shown.map((e) => {
      const was = own(before.userdata, `${containerOf(e.path)} ${e.key}`);
      return html`<div class="diff"><b>${e.key}</b>${" "}
        <del>${was ? brief(was.value).slice(0, CHANGE) : "unset"}</del>${" "}
        <ins>${brief(e.value).slice(0, CHANGE)}</ins>${" "}
        <small>by <${StateLink} path=${e.path} page=${page} /></small></div>`;
    })}
    <${More} left=${writes.length - shown.length} onMore=${() => setWhole(true)} /><//>`;
}
