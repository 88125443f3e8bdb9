// The keyboard shortcuts: everything that the pointer can do.

import { command, confirmation, control } from "#core/commands.ts";
import { showWhy } from "#core/connection.ts";
import { isFile } from "#core/page_file.ts";
import type { PageName } from "#core/pages.ts";
import { showPage } from "#core/pages.ts";
import { CLOCKS } from "#core/store/clock.ts";
import { store } from "#core/store.ts";
import type { Page } from "#drawing/page.ts";
import { isDark } from "#drawing/theme.ts";

const STEP = 80; // [px]
const PRESSED = "a[href], button, summary, tr[tabindex]"; // Enter and Space press these
const ON_OTHERS = ["a", "d", "h", "?", "Escape"]; // keys that work on pages other than a machine
const ARROWS: Record<string, [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** Go to a change of the chosen userdata key. */
function jumpToChange(step: number) {
  const key = store.playback.followedKey.value ?? [...store.data.marks.keys].sort()[0];
  if (key !== undefined) store.playback.jump(`key ${key}`, step);
}

/** Show a page, or leave it for the machine; the list of runs stays while there is none. */
export function togglePage(name: PageName) {
  if (store.view.pageShown.value !== name) showPage(name);
  else if (store.data.model.value || name !== "runs") showPage("machine");
}

export function listenToKeys(page: Page) {
  const actions: Record<string, () => unknown> = {
    "/": () => document.getElementById("search")?.focus(),
    0: () => page.layouts.refit(),
    f: () => store.playback.jump("kind failure", 1),
    F: () => store.playback.jump("kind failure", -1),
    p: () => store.playback.jump("kind preempt", 1),
    P: () => store.playback.jump("kind preempt", -1),
    g: () => store.playback.jump("kind goal", 1),
    G: () => store.playback.jump("kind goal", -1),
    k: () => jumpToChange(1),
    K: () => jumpToChange(-1),
    Home: () => store.playback.seek(store.data.run.first()),
    End: () => page.timeline.live(),
    m: () => {
      store.view.part.value = "map";
      page.map.canvas.focus();
    },
    r: () => store.playback.toggleLoop(),
    "[": () => store.playback.moveStretch("from"),
    "]": () => store.playback.moveStretch("to"),
    c: () => store.clock.choose(CLOCKS[(CLOCKS.indexOf(store.clock.chosen.value) + 1) % CLOCKS.length]),
    w: () => showWhy(),
    n: () => store.notes.begin(),
    t: () => {
      store.view.treeOpen.value = !store.view.treeOpen.value;
    },
    o: () => page.layouts.setFollow(!store.view.follow.value),
    "+": () => page.view.zoom(1.25),
    "=": () => page.view.zoom(1.25),
    "-": () => page.view.zoom(0.8),
    ",": () => store.playback.seekEvent(-1),
    ".": () => store.playback.seekEvent(1),
    l: () => page.timeline.live(),
    i: () => page.layouts.setImplicit(!store.view.implicit.value),
    h: () => isFile() || togglePage("runs"),
    a: () => isFile() || togglePage("actions"),
    d: () => page.setTheme(isDark() ? "light" : "dark"),
    "?": () => {
      store.view.help.value = !store.view.help.value;
    },
    Enter: () => page.layouts.toggle(store.view.selected.value),
    Escape: () => {
      if (confirmation.value) confirmation.value = null;
      else if (store.view.help.value) store.view.help.value = false;
      else if (store.notes.writtenAt.value !== null) store.notes.writtenAt.value = null;
      else if (store.view.tokenAsked.value) store.view.tokenAsked.value = false;
      else if (store.view.pageShown.value !== "machine") togglePage(store.view.pageShown.value);
      else if (store.view.treeOpen.value) store.view.treeOpen.value = false;
      else if (store.playback.stretch.value) store.playback.selectStretch(0);
      else page.select(null);
    },
    " ": () => {
      const paused = control()?.paused;
      if (paused === undefined || store.playback.cursor.value !== null) store.playback.togglePlaying();
      else command(paused ? "resume" : "pause");
    },
    s: () => control() && command("step"),
  };
  // After a click a button loses the focus: otherwise the next Space, meant to pause, would press it again. A button
  // reached by Tab keeps it.
  document.addEventListener("click", (e) => {
    const pressed = e.target instanceof Element ? e.target.closest("button") : null;
    if (e.detail > 0 && pressed === document.activeElement) pressed?.blur();
  });
  document.addEventListener("keydown", (e) => {
    const target = e.target as HTMLElement;
    if ((e.ctrlKey || e.metaKey) && e.key.toLowerCase() === "k" && !document.querySelector("dialog[open]")) {
      store.view.paletteOpen.value = true;
      e.preventDefault();
      return;
    }
    if (e.ctrlKey || e.metaKey || e.altKey || store.view.paletteOpen.value) return;
    if (["INPUT", "SELECT", "TEXTAREA"].includes(target.tagName)) {
      if (e.key === "Escape") target.blur();
      return;
    }
    if ((e.key === "Enter" || e.key === " ") && target.closest(PRESSED)) return;
    if (document.querySelector("dialog[open]") && e.key !== "Escape" && e.key !== "?") return;
    if (!store.view.shortcuts.value && e.key !== "Escape") return;
    if (store.view.pageShown.value !== "machine" && !ON_OTHERS.includes(e.key)) return;
    if (e.key in ARROWS) {
      const [dx, dy] = ARROWS[e.key];
      if (store.view.selected.value && !e.shiftKey) page.selectNeighbour(dx, dy);
      else page.view.pan(-dx * STEP, -dy * STEP);
    } else if (/^[1-9]$/.test(e.key)) page.layouts.setDepth(Number(e.key));
    else if (Object.hasOwn(actions, e.key)) actions[e.key]();
    else return;
    e.preventDefault();
  });
}
