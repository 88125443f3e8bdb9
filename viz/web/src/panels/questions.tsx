// Cards above all panels: questions of the mission to its operator, and states that wait at a breakpoint.

import { useEffect, useRef, useState } from "preact/hooks";
import { canAnswer, command, control } from "#core/commands.ts";
import { choose } from "#core/connection.ts";
import { isFile } from "#core/page_file.ts";
import type { ShownQuestion } from "#core/questions.ts";
import { answerText, buttonsOf, heldStates, isUrgent, questionsOf, titleOf } from "#core/questions.ts";
import { encoded, link } from "#core/requests.ts";
import { store } from "#core/store.ts";
import { shorten, shortenLines } from "#core/text.ts";
import type { MachineSummary } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { StateLink } from "#panels/components.tsx";

const RADIUS = 18;
const AROUND = 2 * Math.PI * RADIUS;
const MOST_ELSEWHERE = 4; // machines
const LONGEST = 600; // characters of a question
const TONES = [880, 1175]; // [Hz]
const TONE_S = 0.16;

/** Instants of the questions for which a sound was played: an older question that is still open is not new. */
const sounded = new Set();

/** The questions to show; those of a live machine are the present ones, independent of the instant shown. */
function questionsShown() {
  const isOver = isFile() || store.data.facts.value?.recorded;
  if (isOver)
    return questionsOf(store.playback.shown(), store.playback.cursor.value ?? store.playback.nowMs()).filter(
      (one) => one.isOpen,
    );
  return questionsOf(store.data.run.now, store.data.liveMs());
}

export function Questions({ page }: { page: Page }) {
  store.playback.watch();
  const shown = store.data.model.value ? questionsShown() : [];
  const held = control() && store.playback.cursor.value === null ? heldStates(store.data.run.now) : [];
  const facts = store.data.facts.value;
  const others = store.data.machines.value.filter((one) => one.name !== facts?.name && one.stale == null);
  const asking = isFile() ? [] : others.filter((one) => one.questions);
  const elsewhere = asking.reduce((sum, one) => sum + (one.questions ?? 0), 0);
  const title = titleOf(facts ? `${facts.label} \u2013 smachpy` : "smachpy", shown, elsewhere);
  useEffect(() => {
    if (!isFile()) document.title = title;
  }, [title]);
  useEffect(() => {
    if (isFile() || facts?.recorded) return;
    const unsounded = shown.filter((one) => one.isOpen && !sounded.has(one.asked));
    for (const one of unsounded) sounded.add(one.asked);
    if (unsounded.length && store.view.sound.value) chime();
  });
  if (!shown.length && !held.length && !asking.length) return null;
  return (
    <section class="questions" aria-label="questions">
      {shown.map((one) => (
        <Card key={`${one.path} ${one.asked}`} one={one} page={page} />
      ))}
      {held.map((path) => (
        <HeldCard key={path} path={path} page={page} />
      ))}
      {asking.slice(0, MOST_ELSEWHERE).map((one) => (
        <Elsewhere key={one.name} machine={one} />
      ))}
    </section>
  );
}

/** A question of a machine that is not shown. */
const Elsewhere = ({ machine }: { machine: MachineSummary }) => (
  <div class="question elsewhere" role="status">
    <span>
      <b>{shorten(machine.label, 40)}</b>
      <span class="hint"> {shorten(machine.name, 60)}</span> asks its operator
    </span>
    <button onClick={() => choose(machine.name)}>Show</button>
  </div>
);

function Card({ one, page }: { one: ShownQuestion; page: Page }) {
  const [sent, setSent] = useState(false);
  const text = useRef<HTMLHeadingElement | null>(null);
  useEffect(() => {
    const focused = document.activeElement;
    if (one.isOpen && (!focused || focused === document.body)) text.current?.focus({ preventScroll: true });
  }, []);
  const give = async (answer: string) => {
    setSent(true);
    const by = store.view.operator.value.trim() || undefined;
    if (!(await command("answer", { path: one.path, answer, by }))) setSent(false);
  };
  const id = `question-${encoded(one.path)}`; // without spaces, which separate ids in aria-labelledby
  return (
    <div class={`question ${one.isOpen ? "" : "over"}`} role="alertdialog" aria-labelledby={id}>
      <header>
        <div>
          <h3 id={id} ref={text} tabindex={-1}>
            {shortenLines(one.text, LONGEST)}
          </h3>
          <StateLink path={one.path} page={page} />
        </div>
        {one.isOpen && <Ring one={one} />}
      </header>
      {one.isOpen && one.has_picture && !isFile() && <Picture one={one} />}
      {one.isOpen ? <Buttons one={one} sent={sent} give={give} page={page} /> : null}
      <p class="hint" role={one.isOpen ? undefined : "status"}>
        {one.isOpen ? (
          <>
            No answer in {Math.ceil(one.left)} s means <b>{shorten(one.default, 80)}</b>.
          </>
        ) : (
          shorten(answerText(one), 200)
        )}
      </p>
    </div>
  );
}

function Buttons({
  one,
  sent,
  give,
  page,
}: {
  one: ShownQuestion;
  sent: boolean;
  give: (answer: string) => void;
  page: Page;
}) {
  if (isFile() || store.data.facts.value?.recorded) return null;
  if (store.playback.cursor.value !== null)
    return (
      <div class="answers">
        <button class="answer primary" onClick={() => page.timeline.live()}>
          Back to live to answer
        </button>
      </div>
    );
  const may = canAnswer();
  const button = ({ answer, text, isFirst }: { answer: string; text: string; isFirst: boolean }) => (
    <button
      class={`answer ${isFirst ? "primary" : ""}`}
      disabled={!may || sent}
      title={answer}
      onClick={() => give(answer)}
    >
      {shorten(text, 60)}
    </button>
  );
  return (
    <>
      <div class="answers">{buttonsOf(one).map(button)}</div>
      {!may && (
        <p class="hint">
          This page cannot answer. In a terminal: <code>smachpy answer ANSWER</code>
        </p>
      )}
    </>
  );
}

/** The time left for an answer. */
const Ring = ({ one }: { one: ShownQuestion }) => (
  <svg class={`ring ${isUrgent(one) ? "urgent" : ""}`} viewBox="0 0 44 44" aria-hidden="true">
    <circle cx="22" cy="22" r={RADIUS} />
    <circle
      class="left"
      cx="22"
      cy="22"
      r={RADIUS}
      transform="rotate(-90 22 22)"
      stroke-dasharray={`${(one.share * AROUND).toFixed(1)} ${AROUND.toFixed(1)}`}
    />
    <text x="22" y="27">
      {Math.ceil(one.left)}
    </text>
  </svg>
);

function Picture({ one }: { one: ShownQuestion }) {
  const [gone, setGone] = useState(false);
  if (gone) return null;
  const source = link("question", `&path=${encoded(one.path)}&asked=${one.asked}`);
  return <img class="question-picture" alt="what the question is about" src={source} onError={() => setGone(true)} />;
}

const HeldCard = ({ path, page }: { path: string; page: Page }) => (
  <div class="question held" role="alertdialog" aria-label="breakpoint">
    <header>
      <h3>
        Paused before <StateLink path={path} page={page} /> (breakpoint)
      </h3>
    </header>
    <div class="answers">
      <button class="answer" onClick={() => command("step")}>
        Step
      </button>
      <button class="answer primary" onClick={() => command("resume")}>
        Resume
      </button>
    </div>
  </div>
);

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
