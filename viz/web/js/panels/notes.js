// Notes at instants of the run, and the link that shows this view to somebody else.
import { useState } from "preact/hooks";
import { isFile } from "#core/connection.js";
import * as store from "#core/store.js";
import { saveFilm } from "#drawing/film.js";
import { fieldValue, html, Section } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

/** @param {{ page: Page }} props */
export function ShareButtons({ page }) {
  const copy = async () => {
    const address = page.address();
    try {
      await navigator.clipboard.writeText(address);
      store.notify(isFile() ? "Link copied, for who has this file" : "Link copied");
    } catch {
      store.notify("This browser lets no page copy here: the address bar shows the link", "error");
    }
  };
  const done = store.filmed.value;
  return html`<span class="share">
    <button title="GIF of the selected stretch, or of the 20 s before the instant shown" disabled=${done !== null}
      onClick=${() => saveFilm(page)}>${done === null ? "GIF" : `GIF ${done} %`}</button>
    <button title="note at the instant shown (n)" onClick=${() => store.askForNote()}>Note</button>
    <button title="copy the address of this view: instant, selection, open containers, notes"
      onClick=${copy}>Link</button></span>`;
}

export function NoteDialog() {
  const [text, setText] = useState("");
  const at = store.noteAt.value;
  if (at === null) return null;
  const close = () => {
    store.noteAt.value = null;
    setText("");
  };
  const onSubmit = (/** @type {Event} */ e) => {
    e.preventDefault();
    store.addNotes([{ at, text }]);
    close();
  };
  return html`<div class="veil"><form class="card note-form" role="dialog" aria-label="note" onSubmit=${onSubmit}
      onKeyDown=${(/** @type {KeyboardEvent} */ e) => e.key === "Escape" && close()}>
    <h2>Note at ${store.instantText(at)}</h2>
    <input aria-label="note" maxlength="300" autocomplete="off" value=${text}
      ref=${(/** @type {HTMLInputElement | null} */ input) => input?.focus()}
      onInput=${(/** @type {Event} */ e) => setText(fieldValue(e))} />
    <p><button class="primary" type="submit" disabled=${!text.trim()}>Pin it</button>${" "}
      <button type="button" onClick=${close}>Cancel</button></p></form></div>`;
}

/** The notes of the run; a click on one goes to its instant. */
export function Notes() {
  const notes = store.notes.value;
  if (!notes.length) return null;
  return html`<${Section} title="Notes" count=${notes.length}><ul class="notes">${notes.map(
    (note) => html`<li key=${`${note.at} ${note.text}`}>
      <button class="link" onClick=${() => store.seek(note.at)}><time>${store.instantText(note.at)}</time></button>
      <span>${note.text}</span>
      <button class="small" aria-label=${`remove the note ${note.text}`}
        onClick=${() => store.removeNote(note)}>\u2715</button></li>`,
  )}</ul><//>`;
}
