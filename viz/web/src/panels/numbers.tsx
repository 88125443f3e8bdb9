// The totals of the numbers in the diagram.
import { outcomeClass } from "#core/outcomes.ts";
import { coverage } from "#core/statistics.ts";
import { store } from "#core/store.ts";
import { duration } from "#core/text.ts";
import { Pill, Section } from "#panels/components.tsx";

export function Numbers() {
  store.playback.watchSlowly();
  if (store.view.numbers.value === "none") return null;
  const { taken, all } = coverage(store.data.model.value, store.playback.shown().states);
  const recorded = store.data.statistics.value;
  return (
    <Section title="Numbers">
      <dl class="facts">
        <dt>transitions taken</dt>
        <dd>
          {taken} of {all} ({all ? Math.round((taken / all) * 100) : 0} %)
        </dd>
        {recorded && (
          <>
            <dt>recorded runs</dt>
            <dd>
              {recorded.runs}, median {duration(recorded.median ?? 0)}
            </dd>
            <dt>they ended</dt>
            <dd>
              {Object.entries(recorded.outcomes).map(([outcome, times]) => (
                <>
                  <Pill kind={outcomeClass(outcome)}>
                    {outcome} ×{times}
                  </Pill>{" "}
                </>
              ))}
            </dd>
          </>
        )}
      </dl>
    </Section>
  );
}
