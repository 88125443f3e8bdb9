// The play bar: the instant shown, the speed of playing, and jumps.
import { useState } from "preact/hooks";
import { isFile } from "#core/connection.js";
import { parseInstant, RATES } from "#core/playback.js";
import * as store from "#core/store.js";
import { shorten } from "#core/text.js";
import { fieldValue, html } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */

/** @type {Record<string, string>} drawn in a box of 16 x 16 */
const ICONS = {
  begin: "M4 3v10M13 3 6 8l7 5Z",
  back: "M11 3 5 8l6 5Z",
  play: "M5 3l8 5-8 5Z",
  pause: "M5 3v10M11 3v10",
  forward: "M5 3l6 5-6 5Z",
  end: "M12 3v10M3 3l7 5-7 5Z",
  loop: "M12 7V5H3.5M5.5 3l-2 2 2 2M4 9v2h8.5M10.5 9l2 2-2 2",
};
/** @type {[string, string, string][]} kind, sign, key */
const KINDS = [
  ["failure", "\u2715", "F"],
  ["preempt", "\u2298", "P"],
  ["goal", "\u25ce", "G"],
];

/** @param {{ name: string, title: string, onClick: () => void, [attribute: string]: any }} props */
const IconButton = ({ name, title, ...more }) =>
  html`<button class="icon-button" title=${title} aria-label=${title} ...${more}>
    <svg viewBox="0 0 16 16" aria-hidden="true"><path d=${ICONS[name]} /></svg></button>`;

/** @param {{ page: Page }} props */
export function PlayBar({ page }) {
  store.tick.value;
  const first = store.run.first();
  if (first === null) return null;
  const goes = store.goes.value;
  const live = store.cursor.value === null;
  const end = isFile() || store.facts.value?.recorded ? "End" : "Live";
  return html`<div class="play" role="region" aria-label="play bar">
    <span class="group">
      <${IconButton} name="begin" title="to the beginning (Home)" onClick=${() => store.seek(first)} />
      <${IconButton} name="back" title="one event back (,)" onClick=${() => store.seekEvent(-1)} />
      <${IconButton} name=${goes ? "pause" : "play"} title=${goes ? "hold the picture" : "play"} id="play"
        onClick=${() => store.togglePlaying()} />
      <${IconButton} name="forward" title="one event forward (.)" onClick=${() => store.seekEvent(1)} />
      <${IconButton} name="end" title="to the end (End)" onClick=${() => page.timeline.live()} /></span>
    <${Clock} />
    <label class="rate"><span class="hidden">speed</span>
      <select value=${store.rate.value} title="speed"
        onChange=${(/** @type {Event} */ e) => store.setRate(Number(fieldValue(e)))}>
        ${RATES.map((rate) => html`<option value=${rate}>${rate} \u00d7</option>`)}</select></label>
    <${LoopButton} />
    <${Jumps} />
    <span class="spread"></span>
    <button title="back to now (l)" class=${`live-button ${live ? "on" : ""}`} aria-pressed=${live}
      onClick=${() => page.timeline.live()}>${end}</button>
  </div>`;
}

function LoopButton() {
  const [on, found] = [store.looping.value, store.stretch.value];
  const what = found
    ? `from ${store.instantText(found.from)} to ${store.instantText(found.to)}`
    : "over the selected state's visit; drag in the timeline to select a stretch";
  return html`<${IconButton} name="loop" class=${`icon-button ${on ? "on" : ""}`} aria-pressed=${on} id="loop"
    title=${`loop ${what} (r)`} onClick=${() => store.toggleLoop()} />`;
}

/** The instant shown, as a text field. */
function Clock() {
  store.tick.value; // read, so that this component without properties is drawn again when the signal changes
  const last = store.run.last() ?? 0;
  // The run must not overwrite what is being typed.
  const [typed, setTyped] = useState(/** @type {string | null} */ (null));
  const onChange = (/** @type {Event} */ e) => {
    const seconds = parseInstant(fieldValue(e));
    if (seconds === null) store.notify(`Instant: got ${shorten(fieldValue(e), 30)}; expected such as 01:32.5`, "error");
    else store.seek((store.began() ?? 0) + seconds * 1000);
    /** @type {HTMLInputElement} */ (e.target).blur();
  };
  const onFocus = (/** @type {Event} */ e) => {
    setTyped(fieldValue(e));
    /** @type {HTMLInputElement} */ (e.target).select();
  };
  return html`<span class="clock"><input value=${typed ?? store.instantText(store.nowMs())} size="9"
      aria-label="instant shown; type another one" title="type an instant to go there" autocomplete="off"
      onInput=${(/** @type {Event} */ e) => setTyped(fieldValue(e))} onChange=${onChange}
      onFocus=${onFocus} onBlur=${() => setTyped(null)} />
    <small>/ ${store.instantText(Math.max(last, store.nowMs()))}</small></span>`;
}

function Jumps() {
  store.slowTick.value;
  const keys = [...store.marks.keys].sort();
  const key = store.followedKey.value ?? keys[0];
  const choose = (/** @type {Event} */ e) => {
    store.followedKey.value = fieldValue(e);
  };
  return html`<span class="jumps" role="group" aria-label="go to the next"><span class="hint">Next</span>
    ${KINDS.map(
      ([kind, sign, letter]) =>
        html`<${Jump} name=${`kind ${kind}`} letter=${letter}><i class=${`to-${kind}`}>${sign}</i> ${kind}<//>`,
    )}
    ${
      keys.length > 0 &&
      html`<select value=${key} onChange=${choose} aria-label="key of userdata" title="key of userdata">
        ${keys.map((one) => html`<option value=${one}>${shorten(one, 24)}</option>`)}</select>
      <${Jump} name=${`key ${key}`} letter="K">change<//>`
    }</span>`;
}

/** @param {{ name: string, letter: string, children?: any }} props */
function Jump({ name, letter, children }) {
  const ahead = store.jumpOf(name, 1) !== null;
  const title = `${ahead ? "go there" : "none ahead"} (${letter.toLowerCase()}); before it: Shift+${letter}`;
  return html`<button class=${ahead ? "" : "none"} aria-disabled=${!ahead} title=${title}
    onClick=${(/** @type {MouseEvent} */ e) => store.jump(name, e.shiftKey ? -1 : 1)}>${children}
    <kbd>${letter}</kbd></button>`;
}
