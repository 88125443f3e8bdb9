// The causes of the run's end, from the first one to the outcome; a click on a step goes to its instant.

import { showWhy } from "#core/connection.ts";
import { copyText } from "#core/share.ts";
import { store } from "#core/store.ts";
import type { Cause } from "#core/types.ts";
import { copyCard } from "#drawing/card.ts";
import type { Page } from "#drawing/page.ts";
import { Section, StateLink } from "#panels/components.tsx";
import { GoodRunsPart } from "#panels/good_runs.tsx";

export function WhyPanel({ page }: { page: Page }) {
  const why = store.data.why.value;
  if (!why) return null;
  const title = why.outcome === null ? "Why has it no end?" : "Why did it end so?";
  return (
    <Section title={title}>
      <div class="why">
        <span class="why-tools">
          <button class="small" onClick={() => copyText(why.text)}>
            Copy as text
          </button>
          <button
            class="small"
            title="a picture of the causes, the diagram and the map"
            onClick={() => copyCard(page, why)}
          >
            Copy as card
          </button>
          <button class="small" aria-label="close" onClick={() => showWhy(false)}>
            ✕
          </button>
        </span>
        {!why.steps.length && <p class="hint">the causes are unknown</p>}
        <ol>
          {why.steps.map((step, i) => (
            <Step step={step} first={i === 0} page={page} />
          ))}
        </ol>
        <GoodRunsPart key={`${why.label} ${why.ended}`} />
      </div>
    </Section>
  );
}

function Step({ step, first, page }: { step: Cause; first: boolean; page: Page }) {
  const goThere = () => {
    store.playback.seek(step.stamp_ns / 1e6);
    page.goTo(step.path);
  };
  return (
    <li class={`${step.kind} ${first ? "first" : ""}`}>
      <button class="step" title={step.path} onClick={goThere}>
        <b>{store.data.nameOf(step.path)}</b> <span class={`word ${step.kind}`}>{step.what}</span>{" "}
        <time>{store.clock.instantText(step.stamp_ns / 1e6, 2)}</time>
      </button>
      {step.reason && <p>{step.reason}</p>}
      {step.detail && <pre>{step.detail}</pre>}
      {step.read.map(([key, value, writer, stamp]) => (
        <p>
          read <b>{key}</b> {value} <small>of</small> <StateLink path={writer} page={page} />{" "}
          <small>{store.clock.instantText(stamp / 1e6, 2)}</small>
        </p>
      ))}
      {step.written.map(([key, value, before]) => (
        <p>
          wrote <b>{key}</b> {value} {before && <small>(was {before})</small>}
        </p>
      ))}
    </li>
  );
}
