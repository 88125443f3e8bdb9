// The view in the fragment of the page's address: written a moment after a change, and shown when a page is opened
// with it.

import type { LinkedView } from "#core/links.ts";
import { fragmentOf, viewOf } from "#core/links.ts";
import { isFile } from "#core/page_file.ts";
import { store } from "#core/store.ts";

const WRITE_MS = 300; // delay between a change and the update of the address

export class Address {
  #linked: LinkedView | null = viewOf(location.hash); // the view in the address, until it is shown
  #due: ReturnType<typeof setTimeout> | undefined;

  constructor() {
    const { view, playback, panels, notes } = store;
    const chosen = [view.selected, view.opened, notes.own, playback.stretch, panels.arrangement, panels.plotsChosen];
    for (const one of [...chosen, playback.instant]) one.subscribe(() => this.#write());
  }

  /** Take the view of the address again, or that of another fragment. */
  read(fragment = location.hash) {
    this.#linked = viewOf(fragment);
  }

  /** The address of the view. */
  get text() {
    const address = new URL(location.href);
    const name = store.data.facts.value?.name;
    if (name && !isFile()) address.searchParams.set("machine", name);
    address.hash = this.fragment;
    return String(address);
  }

  /** The view as the fragment of an address. */
  get fragment() {
    const { view, playback, panels, notes } = store;
    const stretch = playback.stretch.value;
    return fragmentOf({
      at: playback.cursor.value,
      selected: view.selected.value,
      opened: [...view.opened.value],
      notes: notes.own.value,
      stretch: stretch && [stretch.from, stretch.to],
      panels: panels.arrangement.value,
      plots: panels.plotsChosen.value,
    });
  }

  #write() {
    clearTimeout(this.#due);
    this.#due = setTimeout(() => {
      if (store.data.model.value && !this.#linked && store.view.pageShown.value === "machine")
        history.replaceState(null, "", `#${this.fragment}`);
    }, WRITE_MS);
  }

  /**
   * Show the view of the address, as far as it exists.
   * @param onInstant called before another instant than now is shown
   */
  show(onInstant: () => void) {
    const model = store.data.model.value;
    const linked = this.#linked;
    this.#linked = null;
    if (!linked || !model) return;
    const { view, playback, panels, notes } = store;
    const known = linked.opened?.filter((path) => model.get(path)?.children.length);
    if (known?.length) view.keepOpened(new Set(known));
    if (linked.notes.length) notes.add(linked.notes);
    if (linked.panels) panels.arrangement.value = linked.panels;
    if (linked.stretch) playback.selectStretch(...linked.stretch);
    if (linked.plots) panels.plotsChosen.value = linked.plots;
    const { run } = store.data;
    const first = run.first();
    const isKept = first !== null && linked.at !== null && linked.at >= first && linked.at <= (run.last() ?? first) + 1;
    if (isKept) {
      onInstant();
      playback.seek(linked.at);
    } else if (linked.at !== null) view.notify("The instant of this link is not in this run", "error");
    if (linked.selected === null) return;
    if (model.get(linked.selected)) {
      view.selected.value = linked.selected;
      view.reveal(linked.selected);
    } else view.notify("The state of this link is not in this machine", "error");
  }
}
