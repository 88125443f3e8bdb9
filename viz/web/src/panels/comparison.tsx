// Two machines, or two runs, in one drawing, with what was added, removed and changed.

import { useState } from "preact/hooks";
import { CHANGE_SIGNS } from "#core/model.ts";
import { isFile } from "#core/page_file.ts";
import { ask, encoded, isFailure, link } from "#core/requests.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Comparison, MachinePayload } from "#core/types.ts";
import type { Answers } from "#core/wire.ts";
import type { Page } from "#drawing/page.ts";
import { fieldValue, More, StateLink } from "#panels/components.tsx";

const MOST = 60; // differences that are listed at first

/** Compare the machine shown with another one; "" ends the comparison. */
async function compare(page: Page, name: string) {
  if (!name) {
    if (!store.data.comparison.value) return;
    const { alone } = store.data.comparison.value;
    store.data.comparison.value = null;
    show(page, alone);
    return;
  }
  const asked = store.data.facts.value?.name;
  const found = await ask<Answers["GET /api/compare"]>(link("compare", `&with=${encoded(name)}`));
  const model = store.data.model.value;
  if (!model || asked !== store.data.facts.value?.name) return; // another machine was chosen meanwhile
  if (isFailure(found)) {
    store.view.notify(found.text, "error");
    return;
  }
  const alone = store.data.comparison.value?.alone ?? model.payload;
  const compared = { ...found, model: found.model as unknown as MachinePayload };
  store.data.comparison.value = { ...compared, alone };
  show(page, compared.model);
}

function show(page: Page, payload: MachinePayload) {
  const opened = store.view.opened.value;
  store.view.setModel(payload);
  store.view.keepOpened(new Set([...opened].filter((path) => store.data.model.value?.get(path)?.children.length)));
  page.select(null);
  page.layouts.layout?.forget();
  page.layouts.relayout({ frame: true });
}

export function CompareLine({ page, onDone }: { page: Page; onDone: () => void }) {
  const others = store.data.machines.value.filter((machine) => machine.name !== store.data.facts.value?.name);
  if (isFile() || !store.data.model.value) return null;
  const title = others.length ? "" : "no other machine or recording here; try: smachpy view old.jsonl new.jsonl";
  const choose = (e: Event) => {
    compare(page, fieldValue(e));
    onDone();
  };
  return (
    <label class="line">
      <span>Compare with</span>
      <select
        id="compare"
        value={store.data.comparison.value?.with ?? ""}
        disabled={!others.length}
        title={title}
        onChange={choose}
      >
        <option value="">{others.length ? "nothing" : "nothing else here"}</option>
        {others.map(({ name }) => (
          <option value={name}>{name}</option>
        ))}
      </select>
    </label>
  );
}

export function CompareChip({ page }: { page: Page }) {
  const found = store.data.comparison.value;
  if (!found) return null;
  return (
    <button class="chip compare-chip" title="show it alone again" onClick={() => compare(page, "")}>
      compared with {found.with} ✕
    </button>
  );
}

export function Differences({ page }: { page: Page }) {
  const found = store.data.comparison.value;
  const [all, setAll] = useState(false);
  if (!found) return null;
  const shown = all ? found.listed : found.listed.slice(0, MOST);
  const [before, now] = found.runs;
  const runs = before && now ? ` (${before} runs) to this (${now}); \u00d7: visits per run` : "";
  return (
    <section>
      <h2>
        Differences <span class="number">{found.listed.length}</span>
      </h2>
      <p class="hint">
        from {found.with}
        {runs}
      </p>
      {!found.listed.length && <p class="hint">no notable difference</p>}
      <ul class="differences">
        {shown.map((one) => (
          <Difference one={one} page={page} />
        ))}
      </ul>
      <More left={found.listed.length - shown.length} onMore={() => setAll(true)} />
    </section>
  );
}

const Difference = ({ one, page }: { one: Comparison["listed"][number]; page: Page }) => (
  <li class={one.change}>
    <b aria-hidden="true">{CHANGE_SIGNS[one.change]}</b>
    <span>
      <StateLink path={one.path} page={page} />
      <span class="hidden"> {one.change}</span>
      {one.text !== one.change ? ` ${shorten(one.text, 300)}` : ""}
    </span>
  </li>
);
