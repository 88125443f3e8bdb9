// The log: events as lines, newest first; a click on a line goes to its instant.

import { useState } from "preact/hooks";
import { KINDS_OF, lineOf } from "#core/log_lines.ts";
import { store } from "#core/store.ts";
import { countOfEvents, shorten } from "#core/text.ts";
import type { RunEvent } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { fieldValue, Section, StateLink } from "#panels/components.tsx";

const LINES = 70; // lines at first, and further ones with each click on "older"
const LOOKED_AT = 6000; // events that are searched for these lines
const LONGEST = 200; // characters

export function Log({ page }: { page: Page }) {
  store.playback.watchSlowly();
  const [text, setText] = useState("");
  const [pages, setPages] = useState(1);
  const end = store.playback.eventsShown();
  const first = Math.max(0, end - pages * LOOKED_AT);
  const most = pages * LINES;
  const wanted = text.toLowerCase();
  const kinds = KINDS_OF[store.view.logFilter.value];
  const lines = [];
  let i = end - 1;
  for (; i >= first && lines.length < most; i--) {
    const e = store.data.run.events[i];
    const missing = i + 1 < end ? (store.data.run.events[i + 1].dropped ?? 0) : 0;
    if (missing)
      lines.push(
        <li key={-e.seq} class="hint">
          {countOfEvents(missing)} missing here
        </li>,
      );
    if (!kinds.has(e.kind)) continue;
    const line = lineOf(e, store.data.model.value?.get(e.path));
    if (wanted && !`${e.path} ${line.text}`.toLowerCase().includes(wanted)) continue;
    const count = i + 1;
    const onClick = () => {
      if (store.playback.cursor.value !== null) store.playback.seekTo(count);
    };
    const t = e.stamp_ns / 1e6;
    lines.push(
      <li
        key={e.seq}
        class={store.pointer.isLit(e.path, t) ? "lit" : ""}
        onClick={onClick}
        {...store.pointer.hoverHandlers(e.path, t)}
      >
        <time>{store.clock.instantText(t, 2)}</time>
        <StateLink path={e.path} page={page} tabindex={lines.length ? -1 : 0} />{" "}
        <span class={`word ${line.kind}`}>{shorten(line.text, LONGEST)}</span>
        {targetOf(e)}
      </li>,
    );
  }
  const oldest = store.data.run.events[0];
  const before = oldest && i < 0 ? oldest.seq - 1 - (oldest.dropped ?? 0) : 0;
  if (before > 0)
    lines.push(
      <li key="before" class="hint">
        of {countOfEvents(before)} before, only counts and newest values are kept
      </li>,
    );
  const all = end.toLocaleString("en");
  const nothing = `nothing more in the last ${(end - first).toLocaleString("en")} of ${all} events; look at older ones`;
  return (
    <Section title="Log">
      <div class="filter">
        <select aria-label="kinds" value={store.view.logFilter.value} onChange={chooseKinds}>
          {Object.keys(KINDS_OF).map((name) => (
            <option value={name}>{name}</option>
          ))}
        </select>
        <input
          aria-label="filter the log"
          placeholder="filter"
          value={text}
          onInput={(e: Event) => setText(fieldValue(e))}
        />
      </div>
      <ol class="log" onKeyDown={moveFocus}>
        {lines}
      </ol>
      {i >= 0 && (
        <button class="small" onClick={() => setPages(pages + 1)}>
          {lines.length < most ? nothing : "older"}
        </button>
      )}
    </Section>
  );
}

/** Of the lines only the first one is a stop of Tab; arrow keys go to the others. */
function moveFocus(e: KeyboardEvent) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[e.key];
  if (!step) return;
  const links = [...(e.currentTarget as HTMLElement).querySelectorAll("button")];
  const at = links.indexOf(document.activeElement as HTMLButtonElement);
  links[at + step]?.focus();
  e.preventDefault();
  e.stopPropagation();
}

const chooseKinds = (e: Event) => {
  store.view.logFilter.value = fieldValue(e);
};

/** The target of a transition, unless its outcome has the same name. */
function targetOf(e: RunEvent) {
  if (e.kind !== "Left") return "";
  const node = store.data.model.value?.get(e.path);
  const link = node && store.data.model.value?.linkOf(node, e.outcome);
  return link && link.target !== e.outcome ? ` \u2192 ${shorten(link.target)}` : "";
}
