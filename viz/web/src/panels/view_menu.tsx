// The menu of what the page shows and how: levels, numbers, colours, panels, keys, downloads.

import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { ALL_LEVELS } from "#core/model.ts";
import { isFile } from "#core/page_file.ts";
import { canReproduce } from "#core/reproduction.ts";
import { encoded, link } from "#core/requests.ts";
import { MODES, OF_RECORDED_RUNS } from "#core/statistics.ts";
import { save } from "#core/storage.ts";
import { store } from "#core/store.ts";
import type { Theme } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { isDark } from "#drawing/theme.ts";
import { ActionsButton } from "#panels/actions.tsx";
import { CompareLine } from "#panels/comparison.tsx";
import { fieldValue } from "#panels/components.tsx";
import { PanelLines } from "#panels/docks.tsx";
import { ReproduceButtons } from "#panels/reproduction.tsx";

const MOST_LEVELS = 9; // levels with a button of their own
const MOST_ACTIVE = 200; // active states in the address of a picture

export const FollowButton = ({ page }: { page: Page }) => (
  <button
    class={store.view.follow.value ? "on" : ""}
    aria-pressed={store.view.follow.value}
    title="follow the running states (o)"
    onClick={() => page.layouts.setFollow(!store.view.follow.value)}
  >
    Follow
  </button>
);

export const toggleTree = () => {
  store.view.treeOpen.value = !store.view.treeOpen.value;
};

export function ViewMenu({ page }: { page: Page }) {
  const [open, setOpen] = useState(false);
  const box = useRef<HTMLDivElement | null>(null);
  useEffect(() => {
    const away = (e: PointerEvent) => {
      if (!box.current?.contains(e.target as Node)) setOpen(false);
    };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, []);
  // With the drawing, not after it: a menu that has just closed must not take the Escape for what came next.
  useLayoutEffect(() => {
    if (!open) return;
    const onKeyDown = (e: KeyboardEvent) => {
      if (e.key !== "Escape") return;
      e.stopPropagation();
      setOpen(false);
      (box.current?.querySelector("button") as HTMLElement | null)?.focus();
    };
    // Before the page's own keys, wherever the focus is: a click takes it from the button.
    addEventListener("keydown", onKeyDown, { capture: true });
    return () => removeEventListener("keydown", onKeyDown, { capture: true });
  }, [open]);
  const onFocusOut = (e: FocusEvent) => {
    if (e.relatedTarget && !box.current?.contains(e.relatedTarget as Node)) setOpen(false);
  };
  const showKeys = () => {
    store.view.help.value = true;
    setOpen(false);
  };
  const onShortcuts = (e: Event) => {
    store.view.shortcuts.value = (e.target as HTMLInputElement).checked;
    save("shortcuts", store.view.shortcuts.value);
  };
  const find = () => {
    store.view.paletteOpen.value = true;
    setOpen(false);
  };
  const onMachine = store.view.pageShown.value === "machine";
  const onImplicit = (e: Event) => page.layouts.setImplicit((e.target as HTMLInputElement).checked);
  const onTheme = (e: Event) => page.setTheme(fieldValue(e) as Theme);
  return (
    <div class="menu" ref={box} onFocusOut={onFocusOut}>
      <button aria-expanded={open} onClick={() => setOpen(!open)}>
        View
      </button>
      {open && (
        <div class="sheet">
          {onMachine && (
            <>
              <div class="line narrow">
                <FollowButton page={page} />
                <ActionsButton />
                <button class="on-phones" onClick={toggleTree}>
                  States
                </button>
                <button class="on-phones" onClick={find}>
                  Find
                </button>
              </div>
              <Levels page={page} />
              <label class="line">
                <span>Implicit transitions</span>
                <input type="checkbox" checked={store.view.implicit.value} onChange={onImplicit} />
              </label>
              <NumbersLine page={page} />
              <ReproduceLine />
              <CompareLine page={page} onDone={() => setOpen(false)} />
            </>
          )}
          <label class="line">
            <span>Colours</span>
            <select value={store.view.theme.value} onChange={onTheme}>
              <option value="system">as the system</option>
              <option value="light">light</option>
              <option value="dark">dark</option>
            </select>
          </label>
          {onMachine && !store.view.isPhone.value && <PanelLines />}
          {!isFile() && <AboutQuestions />}
          {onMachine && !isFile() && <Downloads />}
          <div class="line">
            <span>Keys</span>
            <button onClick={showKeys}>show (?)</button>
          </div>
          <label class="line">
            <span>Single keys are shortcuts</span>
            <input type="checkbox" checked={store.view.shortcuts.value} onChange={onShortcuts} />
          </label>
        </div>
      )}
    </div>
  );
}

function ReproduceLine() {
  if (!canReproduce()) return null;
  return (
    <div class="line">
      <span>This run again</span>
      <ReproduceButtons />
    </div>
  );
}

/** Settings for questions: sound, and the name under which they are answered. */
function AboutQuestions() {
  const onSound = (e: Event) => {
    store.view.sound.value = (e.target as HTMLInputElement).checked;
    save("sound", store.view.sound.value);
  };
  const onName = (e: Event) => {
    store.view.operator.value = fieldValue(e);
    save("operator", store.view.operator.value);
  };
  return (
    <>
      <label class="line">
        <span>Sound for questions</span>
        <input type="checkbox" checked={store.view.sound.value} onChange={onSound} />
      </label>
      <label class="line">
        <span>You answer as</span>
        <input maxlength={60} placeholder="your name" value={store.view.operator.value} onInput={onName} />
      </label>
    </>
  );
}

function Levels({ page }: { page: Page }) {
  const depths = store.data.model.value?.order.map((node) => node.depth) ?? [];
  const deepest = depths.reduce((most, depth) => Math.max(most, depth), 1);
  const levels = Array.from({ length: Math.min(deepest, MOST_LEVELS) }, (_, i) => i + 1);
  return (
    <div class="line">
      <span>Levels</span>
      <span class="group">
        {levels.map((level) => (
          <button onClick={() => page.layouts.setDepth(level)}>{level}</button>
        ))}
        <button onClick={() => page.layouts.setDepth(ALL_LEVELS)}>all</button>
      </span>
    </div>
  );
}

function NumbersLine({ page }: { page: Page }) {
  const isMissing = (mode: string) => OF_RECORDED_RUNS.includes(mode) && !store.data.statistics.value;
  return (
    <label class="line">
      <span>Numbers</span>
      <select value={store.view.numbers.value} onChange={(e: Event) => page.setNumbers(fieldValue(e))}>
        {MODES.map(([mode, text]) => (
          <option value={mode} disabled={isMissing(mode)}>
            {text}
          </option>
        ))}
      </select>
    </label>
  );
}

/** Downloads: pictures of the whole machine with the states active at the instant shown, and the run. */
function Downloads() {
  const active = store.status.activePaths.value.slice(0, MOST_ACTIVE).map((path) => `&active=${encoded(path)}`);
  const looks = `&theme=${isDark() ? "dark" : "light"}${active.join("")}`;
  const picture = (format: string) => (
    <a class="button" href={link("picture", `&format=${format}${looks}`)} download>
      {format}
    </a>
  );
  return (
    <>
      <div class="line">
        <span>Save picture</span>
        <span class="group">{["svg", "png", "pdf", "dot"].map(picture)}</span>
      </div>
      <div class="line">
        <span>Save run</span>
        <span class="group">
          <a class="button" href={link("export", "&format=html")} download>
            html page
          </a>
          <a class="button" href={link("export", "&format=jsonl")} download>
            recording
          </a>
        </span>
      </div>
    </>
  );
}
