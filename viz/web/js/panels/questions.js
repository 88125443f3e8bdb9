// Cards above all panels: questions of the mission to its operator, and states that wait at a breakpoint.
import { useEffect, useRef, useState } from "preact/hooks";
import { canAnswer, command, control, encoded, isFile, link } from "#core/connection.js";
import { answerText, buttonsOf, heldStates, isUrgent, questionsOf, titleOf } from "#core/questions.js";
import * as store from "#core/store.js";
import { shorten, shortenLines } from "#core/text.js";
import { html, StateLink } from "#panels/html.js";

/** @typedef {import("#drawing/page.js").Page} Page */
/** @typedef {import("#core/questions.js").ShownQuestion} ShownQuestion */

const RADIUS = 18;
const AROUND = 2 * Math.PI * RADIUS;
const LONGEST = 600; // characters of a question
const TONES = [880, 1175]; // [Hz]
const TONE_S = 0.16;

/** Instants of the questions for which a sound was played: an older question that is still open is not new. */
const sounded = new Set();

/** The questions to show; those of a live machine are the present ones, independent of the instant shown. */
function questionsShown() {
  const isOver = isFile() || store.facts.value?.recorded;
  if (isOver) return questionsOf(store.shown(), store.cursor.value ?? store.nowMs()).filter((one) => one.isOpen);
  return questionsOf(store.run.now, store.liveMs());
}

/** @param {{ page: Page }} props */
export function Questions({ page }) {
  store.tick.value;
  const shown = store.model.value ? questionsShown() : [];
  const held = control() && store.cursor.value === null ? heldStates(store.run.now) : [];
  const facts = store.facts.value;
  const others = store.machines.value.filter((one) => one.name !== facts?.name && one.stale == null);
  const elsewhere = others.reduce((sum, one) => sum + (one.questions ?? 0), 0);
  const title = titleOf(facts ? `${facts.label} \u2013 smachpy` : "smachpy", shown, elsewhere);
  useEffect(() => {
    if (!isFile()) document.title = title;
  }, [title]);
  useEffect(() => {
    if (isFile() || facts?.recorded) return;
    const unsounded = shown.filter((one) => one.isOpen && !sounded.has(one.asked));
    for (const one of unsounded) sounded.add(one.asked);
    if (unsounded.length && store.sound.value) chime();
  });
  if (!shown.length && !held.length) return null;
  return html`<section class="questions" aria-label="questions">
    ${shown.map((one) => html`<${Card} key=${`${one.path} ${one.asked}`} one=${one} page=${page} />`)}
    ${held.map((path) => html`<${HeldCard} key=${path} path=${path} page=${page} />`)}
  </section>`;
}

/** @param {{ one: ShownQuestion, page: Page }} props */
function Card({ one, page }) {
  const [sent, setSent] = useState(false);
  const text = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    const focused = document.activeElement;
    if (one.isOpen && (!focused || focused === document.body)) text.current?.focus({ preventScroll: true });
  }, []);
  const give = async (/** @type {string} */ answer) => {
    setSent(true);
    const by = store.operator.value.trim() || undefined;
    if (!(await command("answer", { path: one.path, answer, by }))) setSent(false);
  };
  const id = `question-${encoded(one.path)}`; // without spaces, which separate ids in aria-labelledby
  return html`<article class=${`question ${one.isOpen ? "" : "over"}`} role="alertdialog" aria-labelledby=${id}>
    <header><div><h3 id=${id} ref=${text} tabindex="-1">${shortenLines(one.text, LONGEST)}</h3>
      <${StateLink} path=${one.path} page=${page} /></div>
      ${one.isOpen && html`<${Ring} one=${one} />`}</header>
    ${one.isOpen && one.has_picture && !isFile() && html`<${Picture} one=${one} />`}
    ${one.isOpen ? html`<${Buttons} one=${one} sent=${sent} give=${give} page=${page} />` : null}
    <p class="hint" role=${one.isOpen ? "" : "status"}>${
      one.isOpen
        ? html`No answer in ${Math.ceil(one.left)} s means <b>${shorten(one.default, 80)}</b>.`
        : shorten(answerText(one), 200)
    }</p></article>`;
}

/** @param {{ one: ShownQuestion, sent: boolean, give: (answer: string) => void, page: Page }} props */
function Buttons({ one, sent, give, page }) {
  if (isFile() || store.facts.value?.recorded) return null;
  if (store.cursor.value !== null)
    return html`<div class="answers"><button class="answer primary"
      onClick=${() => page.timeline.live()}>Back to live to answer</button></div>`;
  const may = canAnswer();
  const button = (/** @type {{ answer: string, text: string, isFirst: boolean }} */ { answer, text, isFirst }) =>
    html`<button class=${`answer ${isFirst ? "primary" : ""}`} disabled=${!may || sent} title=${answer}
      onClick=${() => give(answer)}>${shorten(text, 60)}</button>`;
  return html`<div class="answers">${buttonsOf(one).map(button)}</div>
    ${!may && html`<p class="hint">This page cannot answer. In a terminal: <code>smachpy answer ANSWER</code></p>`}`;
}

/** The time left for an answer. @param {{ one: ShownQuestion }} props */
const Ring = ({ one }) =>
  html`<svg class=${`ring ${isUrgent(one) ? "urgent" : ""}`} viewBox="0 0 44 44" aria-hidden="true">
    <circle cx="22" cy="22" r=${RADIUS} />
    <circle class="left" cx="22" cy="22" r=${RADIUS} transform="rotate(-90 22 22)"
      stroke-dasharray=${`${(one.share * AROUND).toFixed(1)} ${AROUND.toFixed(1)}`} />
    <text x="22" y="27">${Math.ceil(one.left)}</text></svg>`;

/** @param {{ one: ShownQuestion }} props */
function Picture({ one }) {
  const [gone, setGone] = useState(false);
  if (gone) return null;
  const source = link("question", `&path=${encoded(one.path)}&asked=${one.asked}`);
  return html`<img class="question-picture" alt="picture of the question" src=${source}
    onError=${() => setGone(true)} />`;
}

/** @param {{ path: string, page: Page }} props */
const HeldCard = ({ path, page }) =>
  html`<article class="question held" role="alertdialog" aria-label="breakpoint">
    <header><h3>Paused before <${StateLink} path=${path} page=${page} /> (breakpoint)</h3></header>
    <div class="answers"><button class="answer" onClick=${() => command("step")}>Step</button>
      <button class="answer primary" onClick=${() => command("resume")}>Resume</button></div></article>`;

/** Play two short tones; browsers may forbid sound until the user has clicked in the page. */
function chime() {
  if (typeof AudioContext === "undefined") return;
  const audio = new AudioContext();
  TONES.forEach((tone, i) => {
    const source = audio.createOscillator();
    const volume = audio.createGain();
    const at = audio.currentTime + i * TONE_S;
    source.frequency.value = tone;
    volume.gain.setValueAtTime(0.12, at);
    volume.gain.exponentialRampToValueAtTime(0.001, at + TONE_S);
    source.connect(volume).connect(audio.destination);
    source.start(at);
    source.stop(at + TONE_S);
    if (i === TONES.length - 1) source.onended = () => audio.close();
  });
}
