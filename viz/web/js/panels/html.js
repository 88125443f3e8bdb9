// Templates, and small components that several panels use.
import htm from "htm";
import { h } from "preact";
import { nameOf } from "#core/store.js";
import { shorten } from "#core/text.js";

/** @typedef {import("#drawing/page.js").Page} Page */

export const html = htm.bind(h);

/** @param {{ title: string, count?: number | null, children?: any }} props */
export const Section = ({ title, count, children }) =>
  html`<section>
    <h2>${title}${count != null && html` <span class="number">${count}</span>`}</h2>
    ${children}
  </section>`;

/** The name of a state as a link to it. @param {{ path: string, page: Page }} props */
export const StateLink = ({ path, page }) =>
  html`<button class="link" title=${shorten(path, 400)} onClick=${() => page.goTo(path)}>${nameOf(path)}</button>`;

/** A button below a shortened list that shows more of it. @param {{ left: number, onMore: () => void }} props */
export const More = ({ left, onMore }) =>
  left > 0 ? html`<button class="small" onClick=${onMore}>and ${left.toLocaleString("en")} more</button>` : null;

/** An outcome or status in the colours of its class. @param {{ kind: string, children?: any }} props */
export const Pill = ({ kind, children }) => html`<span class=${`pill-text ${kind}`}>${children}</span>`;

/** The value of a field. @param {Event} e */
export const fieldValue = (e) => /** @type {HTMLInputElement} */ (e.target).value;
