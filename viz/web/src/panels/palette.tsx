// The palette (Ctrl+K): finds states, userdata keys, instants, machines, runs and commands by their names.

import { useEffect, useRef, useState } from "preact/hooks";
import { command, control, targetText } from "#core/commands.ts";
import { choose, showWhy } from "#core/connection.ts";
import { KIND_NAMES } from "#core/model.ts";
import { isFile } from "#core/page_file.ts";
import { showPage } from "#core/pages.ts";
import { asked, type Item, ranked, SIGNS } from "#core/palette.ts";
import { parseInstant } from "#core/playback.ts";
import { canReproduce, reproduce } from "#core/reproduction.ts";
import { hasToken } from "#core/requests.ts";
import { openRun, refreshRuns } from "#core/run_requests.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import { brief } from "#core/values.ts";
import type { Page } from "#drawing/page.ts";
import { isDark } from "#drawing/theme.ts";
import { Dialog, fieldValue } from "#panels/components.tsx";

const MOST_RUNS = 300;

/** Everything that can be found now. Preempting, jumping and answering are done where they are seen, not here. */
function itemsNow(page: Page, text: string): Item[] {
  return [...instants(text), ...commands(page), ...states(page), ...keys(page), ...runs()];
}

function instants(text: string): Item[] {
  const seconds = parseInstant(asked(text).words);
  const began = store.playback.began();
  if (seconds === null || began === null) return [];
  const at = began + 1000 * seconds;
  return [{ kind: "instant", name: store.clock.runText(at), more: "go there", pick: () => store.playback.seek(at) }];
}

function commands(page: Page): Item[] {
  const item = (name: string, keys: string, pick: () => unknown, more = ""): Item => {
    return { kind: "command", name, more, keys, pick };
  };
  const found: Item[] = [];
  if (!isFile())
    found.push(
      item("Runs", "h", () => showPage("runs"), "live and past runs"),
      item("Fleet", "", () => showPage("fleet"), "the live runs together"),
      item("Actions", "a", () => showPage("actions"), "send goals, see those of others"),
    );
  found.push(
    item(isDark() ? "Light colours" : "Dark colours", "d", () => page.setTheme(isDark() ? "light" : "dark")),
    item("All keys", "?", () => {
      store.view.help.value = true;
    }),
  );
  if (!store.data.model.value) return found;
  const facts = control();
  if (facts && hasToken() && store.status.whyDisarmed.value === null) {
    const [name, what] = facts.paused ? ["resume", "Resume"] : ["pause", "Pause"];
    found.push(item(`${what} ${targetText()}`, "Space", () => command(name)));
    if (facts.paused) found.push(item(`Step ${targetText()}`, "s", () => command("step")));
  }
  found.push(
    item(
      store.view.follow.value ? "Do not follow" : "Follow",
      "o",
      () => page.layouts.setFollow(!store.view.follow.value),
      "what runs",
    ),
    item("Live", "l", () => page.timeline.live(), "the present, or the end"),
    item("Show everything", "0", () => page.layouts.refit()),
    item("Whole run", "", () => page.timeline.window.fitAll(), "in the timeline"),
    item("Next failure", "f", () => store.playback.jump("kind failure", 1)),
    item("Next preempt", "p", () => store.playback.jump("kind preempt", 1)),
    item("Next goal", "g", () => store.playback.jump("kind goal", 1)),
    item("Why?", "w", () => showWhy(), "from the first cause to the outcome"),
    ...(canReproduce()
      ? [
          item("Reproduce this run", "", () => reproduce("run"), "with today's code, answered as it was then"),
          item("Make a test of this run", "", () => reproduce("test"), "for pytest"),
        ]
      : []),
    item("Note", "n", () => store.notes.begin(), "at the instant shown"),
    item("Implicit transitions", "i", () => page.layouts.setImplicit(!store.view.implicit.value), "show or hide"),
  );
  return found;
}

const states = (page: Page): Item[] =>
  (store.data.model.value?.order ?? []).map((node) => ({
    kind: "state",
    name: node.name,
    more: node.parent ? node.parent.path : KIND_NAMES[node.kind],
    pick: () => page.goTo(node.path),
  }));

const keys = (page: Page): Item[] =>
  Object.values(store.playback.shown().userdata).map(({ key, value, writer, at }) => ({
    kind: "key",
    name: key,
    more: `${brief(value).slice(0, 60)} by ${store.data.nameOf(writer)}`,
    pick: () => {
      store.playback.followedKey.value = key;
      page.goTo(writer);
      if (store.playback.cursor.value !== null || !store.playback.goes.value) store.playback.seek(at / 1e6);
    },
  }));

function runs(): Item[] {
  const machines = store.data.machines.value.map(
    ({ name, label, recorded }): Item => ({
      kind: "run",
      name: label,
      more: `${name}${recorded ? ", recorded" : ""}`,
      pick: () => choose(name),
    }),
  );
  const others = store.data.runs.value.runs.filter(({ name }) => name === null).slice(0, MOST_RUNS);
  const past = others.map(
    ({ id, machine, outcome, file }): Item => ({
      kind: "run",
      name: machine,
      more: [outcome, file].filter(Boolean).join(", "),
      pick: () => openRun(id),
    }),
  );
  return [...machines, ...past];
}

const SIGN_OF = Object.fromEntries(Object.entries(SIGNS).map(([sign, kind]) => [kind, sign]));

export function Palette({ page }: { page: Page }) {
  return store.view.paletteOpen.value ? <Open page={page} /> : null;
}

const close = () => {
  store.view.paletteOpen.value = false;
};

function Open({ page }: { page: Page }) {
  const [text, setText] = useState("");
  const [at, setAt] = useState(0);
  const list = useRef<HTMLUListElement | null>(null);
  useEffect(() => {
    if (!isFile()) refreshRuns();
  }, []);
  const found = ranked(itemsNow(page, text), text);
  const chosen = Math.min(at, found.length - 1);
  useEffect(() => list.current?.children[chosen]?.scrollIntoView({ block: "nearest" }), [chosen]);
  const pick = (item: Item | undefined) => {
    if (!item) return;
    close();
    if (["state", "key", "instant"].includes(item.kind)) showPage("machine");
    item.pick();
  };
  const onKeyDown = (e: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[e.key];
    if (e.key === "Enter") pick(found[chosen]);
    else if (step) setAt(Math.max(0, Math.min(chosen + step, found.length - 1)));
    else return;
    e.preventDefault();
    e.stopPropagation();
  };
  const onInput = (e: Event) => {
    setText(fieldValue(e));
    setAt(0);
  };
  return (
    <Dialog label="find" class="palette" onClose={close}>
      <input
        role="combobox"
        aria-expanded={true}
        aria-controls="palette-list"
        aria-activedescendant={found.length ? `palette-${chosen}` : undefined}
        aria-label="Find states, runs, instants, keys and commands"
        placeholder="Find or do…"
        autocomplete="off"
        spellcheck={false}
        value={text}
        onInput={onInput}
        onKeyDown={onKeyDown}
      />
      <ul id="palette-list" role="listbox" aria-label="found" ref={list}>
        {found.map((item, i) => (
          <li
            id={`palette-${i}`}
            role="option"
            aria-selected={i === chosen}
            class={i === chosen ? "at" : ""}
            onClick={() => pick(item)}
          >
            <i aria-hidden="true">{SIGN_OF[item.kind]}</i>
            <b>{shorten(item.name, 60)}</b>
            <small>{shorten(item.more, 90)}</small>
            {item.keys && <kbd>{item.keys}</kbd>}
          </li>
        ))}
        {!found.length && <li class="none">nothing of this name</li>}
      </ul>
      <p class="hint">
        {Object.entries(SIGNS).map(([sign, kind]) => (
          <span key={sign}>
            <kbd>{sign}</kbd> {kind}s{" "}
          </span>
        ))}
      </p>
    </Dialog>
  );
}
