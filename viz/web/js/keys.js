// The keyboard: everything the pointer can do.
import * as store from "viewer/store";
import { canControl, command, isFile, showActions } from "viewer/source";

const STEP = 80;
const PRESSED = "a[href], button, summary, tr[tabindex]"; // Enter and Space are theirs
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export function listen(page) {
  const plain = {
    "/": () => document.getElementById("search")?.focus(),
    f: () => page.fit(), F: () => page.fit(),
    o: () => page.setFollow(!store.follow.value),
    "+": () => page.view.zoom(1.25), "=": () => page.view.zoom(1.25), "-": () => page.view.zoom(0.8),
    ",": () => store.seekEvent(-1), ".": () => store.seekEvent(1), l: () => page.timeline.live(),
    i: () => page.setImplicit(!store.implicit.value),
    a: () => { if (!isFile()) showActions(!store.actionsOpen.value); },
    d: () => page.setTheme(store.isDark() ? "light" : "dark"),
    "?": () => { store.help.value = !store.help.value; },
    Enter: () => page.toggleSelected(),
    Escape: () => {
      if (store.help.value) store.help.value = false;
      else if (store.actionsOpen.value) showActions(false);
      else page.select(null);
    },
    " ": () => { if (canControl()) command(store.facts.value.control.paused ? "resume" : "pause"); },
    s: () => { if (canControl()) command("step"); },
  };
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (["INPUT", "SELECT", "TEXTAREA"].includes(e.target.tagName)) {
      if (e.key === "Escape") e.target.blur();
      return;
    }
    if ((e.key === "Enter" || e.key === " ") && e.target.closest(PRESSED)) return;
    if (store.actionsOpen.value && !["a", "d", "?", "Escape"].includes(e.key)) return;
    if (e.key in ARROWS) {
      const [dx, dy] = ARROWS[e.key];
      if (store.selected.value && !e.shiftKey) page.step(dx, dy);
      else page.view.pan(-dx * STEP, -dy * STEP);
    } else if (/^[1-9]$/.test(e.key)) page.setDepth(Number(e.key));
    else if (e.key in plain) plain[e.key]();
    else return;
    e.preventDefault();
  });
}
