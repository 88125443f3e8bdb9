// Where the panels are, and what is plotted.

import type { Signal } from "@preact/signals";
import { computed, signal } from "@preact/signals";
import type { Arrangement } from "#core/arrangement.ts";
import { arrangementOf, PANELS, usual, wordOf } from "#core/arrangement.ts";
import { own } from "#core/fold.ts";
import { knownPlots, MOST_LINES, MOST_PLOTS, usualPlots } from "#core/series.ts";
import { save, saved } from "#core/storage.ts";
import type { Data } from "#core/store/data.ts";
import type { Playback } from "#core/store/playback.ts";
import type { View } from "#core/store/view.ts";

const PLOTTED_MACHINES = 30; // machines whose plots are kept in the browser

export class Panels {
  /** null: the usual one */
  readonly arrangement: Signal<Arrangement | null> = signal(arrangementOf(saved<unknown>("panels", null)));
  readonly hasMap = signal(false); // whether there is anything to show on a map
  /** ids of series by plot; null: no choice was made */
  readonly plotsChosen: Signal<string[][] | null> = signal(null);
  #data: Data;
  #playback: Playback;
  #view: View;
  #usualPlots: string[][] = [];

  constructor(data: Data, playback: Playback, view: View) {
    this.#data = data;
    this.#playback = playback;
    this.#view = view;
  }

  /** The arrangement in use; phones have a fixed one. */
  readonly arrangementShown = computed(() =>
    this.#view.isPhone.value ? usual() : (this.arrangement.value ?? usual()),
  );

  /** Names of the panels that have something to show. */
  readonly panelsThere = computed(() => {
    const isThere = { map: this.hasMap.value, plots: this.plotsShown.value.length > 0 };
    return new Set(PANELS.filter((name) => (isThere as Record<string, boolean>)[name] ?? true));
  });

  /** @param next null: the usual one */
  arrange(next: Arrangement | null) {
    this.arrangement.value = next;
    save("panels", next && wordOf(next));
  }

  // -- plots ------------------------------------------------------------------------------------

  readonly plotsShown = computed(() => {
    this.#playback.watchSlowly();
    if (this.plotsChosen.value) return this.plotsChosen.value;
    const found = usualPlots(this.#playback.shown(), this.#data.scene.series.keys());
    const isMore = found.flat().length > this.#usualPlots.flat().length; // a plot never disappears during a run
    if (isMore) this.#usualPlots = found;
    return this.#usualPlots;
  });

  get #machine() {
    return this.#data.model.value?.root.label;
  }

  /** Load the plots of the machine shown. */
  loadPlots() {
    const kept = saved<Record<string, unknown>>("plots", {});
    this.#usualPlots = [];
    const mine = own(kept, this.#machine ?? "");
    this.plotsChosen.value = mine === undefined ? null : knownPlots(mine);
  }

  setPlots(next: string[][]) {
    const plots = knownPlots(next);
    this.plotsChosen.value = plots;
    if (plots.flat().length < next.flat().length)
      this.#view.notify(`There are ${MOST_PLOTS} plots of ${MOST_LINES} lines at most: remove one first`, "error");
    const name = this.#machine;
    if (name === undefined) return;
    const others = Object.entries(saved("plots", {})).filter(([one]) => one !== name);
    save("plots", Object.fromEntries([...others, [name, plots]].slice(-PLOTTED_MACHINES)));
  }

  /** @param number of the plot */
  addLine(number: number, id: string) {
    this.setPlots(this.plotsShown.value.map((ids, i) => (i === number ? [...ids, id] : ids)));
  }

  /** @param number of the plot */
  removeLine(number: number, id: string) {
    this.setPlots(this.plotsShown.value.map((ids, i) => (i === number ? ids.filter((one) => one !== id) : ids)));
  }
}
