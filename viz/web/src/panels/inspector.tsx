// The panel beside the diagram: questions, the selected state, preempts, goals, userdata, numbers, problems, the log.

import { store } from "#core/store.ts";
import { countOfEvents, shorten } from "#core/text.ts";
import type { Problem } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { Differences } from "#panels/comparison.tsx";
import { StateLink } from "#panels/components.tsx";
import { Goals } from "#panels/goals.tsx";
import { Log } from "#panels/log.tsx";
import { Notes } from "#panels/notes.tsx";
import { Numbers } from "#panels/numbers.tsx";
import { Preempts } from "#panels/preempts.tsx";
import { ReproductionPanel } from "#panels/reproduction.tsx";
import { SelectedState } from "#panels/selected_state.tsx";
import { Changes, Userdata } from "#panels/userdata.tsx";
import { WhyPanel } from "#panels/why.tsx";

const MOST_PROBLEMS = 30;

export function Inspector({ page }: { page: Page }) {
  store.playback.watchSlowly();
  const model = store.data.model.value;
  if (!model) return <aside class="inspector" />;
  const shared = { page, data: store.playback.shown(), now: store.playback.nowMs() };
  return (
    <aside class="inspector" aria-label="details">
      <MissingEvents dropped={shared.data.dropped ?? 0} />
      <ReproductionPanel page={page} />
      <WhyPanel page={page} />
      <SelectedState {...shared} model={model} />
      <Differences page={page} />
      <Preempts {...shared} />
      <Notes />
      <Goals {...shared} />
      <Userdata {...shared} />
      <Changes page={page} />
      <Numbers />
      <Problems page={page} />
      <Log page={page} />
    </aside>
  );
}

function MissingEvents({ dropped }: { dropped: number }) {
  const gap = store.data.gap.value;
  return (
    <>
      {gap !== null && (
        <p class="hint gap" role="status">
          This page missed {countOfEvents(gap)}. They and all before them are counted, but not in the timeline.
        </p>
      )}
      {dropped > 0 && (
        <p class="hint gap" role="status">
          Events came faster than they could be sent: {countOfEvents(dropped)} are missing, so all counts are too low.
        </p>
      )}
    </>
  );
}

function Problems({ page }: { page: Page }) {
  const found = store.data.problems.value;
  if (!found.length) return null;
  const text = (one: Problem) =>
    shorten(one.text.startsWith(`${one.path}: `) ? one.text.slice(one.path.length + 2) : one.text, 600);
  return (
    <section>
      <details class="fold-up">
        <summary>
          <h2>
            Problems of the machine <span class="number">{found.length}</span>
          </h2>
        </summary>
        <ul class="problems">
          {found.slice(0, MOST_PROBLEMS).map((one) => (
            <li class={one.severity}>
              <StateLink path={one.path} page={page} /> {text(one)}
            </li>
          ))}
        </ul>
      </details>
    </section>
  );
}
