// The userdata of all containers, and the changes by a transition.

import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import type { VNode } from "preact";
import { useState } from "preact/hooks";
import { containerOf, own } from "#core/fold.ts";
import { isFile } from "#core/page_file.ts";
import { ask, encoded, link } from "#core/requests.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { RunState, UserdataEntry } from "#core/types.ts";
import { branchOf, brief, wasShortened } from "#core/values.ts";
import type { Answers } from "#core/wire.ts";
import type { Page } from "#drawing/page.ts";
import { More, Section, StateLink } from "#panels/components.tsx";

const FRESH_MS = 900; // time for which a written value is highlighted
const MOST_VALUES = 60;
const MOST_CHANGES = 8;
const SHORT = 160; // characters; browsers take minutes to break lines with thousands of them
const CHANGE = 60;
const MOST_ITEMS = 100; // of a list
const LONGEST = 2000; // characters
const RUNS = 1e20; // later than any time [ns]

export function Userdata({ page, data, now }: { page: Page; data: RunState; now: number }) {
  const [open, setOpen]: [string | null, (id: string | null) => void] = useState<string | null>(null);
  const [most, setMost] = useState(MOST_VALUES);
  const entries = sorted(data);
  const several = new Set(entries.map(([, entry]) => entry.container)).size > 1;
  const rows = entries.slice(0, most).map(([id, entry], i) => {
    const isFirst = several && entries[i - 1]?.[1].container !== entry.container;
    const onClick = () => setOpen(open === id ? null : id);
    return (
      <>
        {isFirst && <ContainerRow path={entry.container} />}
        <Row key={id} entry={entry} open={open === id} onClick={onClick} now={now} page={page} />
      </>
    );
  });
  return (
    <Section title="Userdata" count={entries.length || null}>
      {!entries.length && <p class="hint">nothing written yet</p>}
      <div class="scroller">
        <table class="userdata">
          <tbody>{rows}</tbody>
        </table>
      </div>
      <More left={entries.length - most} onMore={() => setMost(most + 4 * MOST_VALUES)} />
    </Section>
  );
}

/** The containers: running ones first, then by their newest written value. */
function sorted(data: RunState) {
  const rank = new Map();
  for (const { container, at } of Object.values(data.userdata)) {
    const runs = own(data.states, container)?.since != null;
    rank.set(container, Math.max(rank.get(container) ?? 0, runs ? RUNS : at));
  }
  return Object.entries(data.userdata).sort(
    ([a, one], [b, other]) => rank.get(other.container) - rank.get(one.container) || (a < b ? -1 : 1),
  );
}

function ContainerRow({ path }: { path: string }) {
  const names = path.split("/").filter(Boolean).slice(-2);
  const title = names.map((name) => shorten(name)).join(" \u203a ");
  return (
    <tr class="group">
      <th colspan={2} title={path}>
        {title}
      </th>
    </tr>
  );
}

function Row({
  entry,
  open,
  onClick,
  now,
  page,
}: {
  entry: UserdataEntry;
  open: boolean;
  onClick: () => void;
  now: number;
  page: Page;
}) {
  const text = brief(entry.value);
  const short = text.length > SHORT ? `${text.slice(0, SHORT)}\u2026` : text;
  const isFresh = now - entry.at / 1e6 < FRESH_MS;
  return (
    <tr class={isFresh ? "fresh" : ""} onClick={onClick}>
      <th scope="row" title={shorten(entry.container, 400)}>
        <button class="key" aria-expanded={open}>
          {shorten(entry.key, 80)}
        </button>
      </th>
      <td>
        <code>{open ? <Whole value={entry.value} /> : short}</code>
        {open && wasShortened(entry.value) && <WholeValue entry={entry} />}
        <small>
          by <StateLink path={entry.writer} page={page} /> at {store.clock.instantText(entry.at / 1e6, 2)}
        </small>
      </td>
    </tr>
  );
}

/** A complete value, as a tree. */
function Whole({ value }: { value: unknown }): VNode {
  const branch = branchOf(value);
  if (typeof branch === "string") return <pre>{branch.slice(0, LONGEST)}</pre>;
  const item = ([name, part]: [string | null, unknown]) => {
    const inner = branchOf(part);
    return (
      <li>
        {name !== null && <b>{shorten(name, 80)}</b>}{" "}
        {typeof inner === "string" ? inner.slice(0, LONGEST) : <Whole value={part} />}
      </li>
    );
  };
  const left = branch.parts.length - MOST_ITEMS;
  return (
    <>
      <span>{branch.name}</span>
      <ul class="value-tree">
        {branch.parts.slice(0, MOST_ITEMS).map(item)}
        {left > 0 && <li>and {left} more</li>}
      </ul>
    </>
  );
}

/** Fetched values by container and key; kept here, as rows come and go. */
const wholeValues: Signal<Record<string, { ok?: boolean; text: string }>> = signal({});

/** Fetches a complete value from the mission: events contain only the beginning of a long one. */
function WholeValue({ entry }: { entry: UserdataEntry }) {
  // Labels can contain slashes, so the container cannot be found in the path.
  const container = store.data.model.value?.get(entry.writer)?.parent?.path ?? entry.container;
  const id = `${store.data.facts.value?.epoch} ${container} ${entry.key}`;
  const found = wholeValues.value[id];
  if (isFile() || store.data.facts.value?.recorded) return <small>shortened when it was recorded</small>;
  const put = (answer: { ok?: boolean; text: string }) => {
    wholeValues.value = { ...wholeValues.value, [id]: answer };
  };
  const fetchIt = async (e: Event) => {
    e.stopPropagation();
    put({ text: "Asking the mission\u2026" });
    put(
      await ask<Answers["GET /api/value"]>(link("value", `&container=${encoded(container)}&key=${encoded(entry.key)}`)),
    );
  };
  if (!found)
    return (
      <button class="small whole" onClick={fetchIt}>
        Fetch the whole value
      </button>
    );
  const text = found.text ?? "";
  return (
    <div class="whole-value" onClick={(e: Event) => e.stopPropagation()}>
      {found.ok ? (
        <>
          <small>
            as it was when it was asked for, {text.length.toLocaleString("en")} characters{" "}
            <button class="small" onClick={fetchIt}>
              again
            </button>
          </small>
          <textarea readonly rows={14} wrap="off" aria-label={`the whole value of ${entry.key}`} value={text} />
        </>
      ) : (
        <p class="error">{text}</p>
      )}
    </div>
  );
}

/** The changes by the transition at the instant shown. */
export function Changes({ page }: { page: Page }) {
  const [whole, setWhole] = useState(false);
  if (store.playback.cursor.value === null) return null;
  const { before, writes } = store.data.run.lastTransition(store.playback.eventsShown());
  const shown = whole ? writes : writes.slice(-MOST_CHANGES);
  return (
    <Section title="Changed by this transition">
      {!writes.length && <p class="hint">no userdata was written</p>}
      {shown.map((e) => {
        const was = own(before.userdata, `${containerOf(e.path)} ${e.key}`);
        return (
          <div class="diff">
            <b>{e.key}</b> <del>{was ? brief(was.value).slice(0, CHANGE) : "unset"}</del>{" "}
            <ins>{brief(e.value).slice(0, CHANGE)}</ins>{" "}
            <small>
              by <StateLink path={e.path} page={page} />
            </small>
          </div>
        );
      })}
      <More left={writes.length - shown.length} onMore={() => setWhole(true)} />
    </Section>
  );
}
