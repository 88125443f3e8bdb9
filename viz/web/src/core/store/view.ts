// The choices of the page's user: the page and the state on view, the open containers, the dialogs.

import type { Signal } from "@preact/signals";
import { computed, signal } from "@preact/signals";
import { Model } from "#core/model.ts";
import type { PageName } from "#core/pages.ts";
import { save, saved } from "#core/storage.ts";
import type { Data } from "#core/store/data.ts";
import type { MachinePayload, StateNode, Theme } from "#core/types.ts";

const AROUND = 60; // states to open around a state of an overview
const SMALL = { names: 0.98, labels: 1.22 }; // scales of the diagram below which they have less than 11 px
const NOTICE_MS = { info: 3000, error: 8000 };

export class View {
  readonly pageShown: Signal<PageName> = signal("machine"); // the page on view
  readonly selected: Signal<string | null> = signal(null); // path of a state
  readonly query = signal(""); // of the search
  readonly follow = signal(false);
  readonly implicit: Signal<boolean> = signal(saved("implicit", false));
  readonly numbers = signal("none"); // a key of statistics.MODES
  readonly theme: Signal<Theme> = signal(saved<Theme>("theme", "system"));
  readonly opened: Signal<Set<string>> = signal(new Set()); // paths of containers
  readonly help = signal(false);
  readonly paletteOpen = signal(false);
  readonly shortcuts = signal(saved("shortcuts", true)); // whether single keys do something
  readonly sound: Signal<boolean> = signal(saved("sound", true)); // whether a new question makes a sound
  readonly operator: Signal<string> = signal(saved("operator", "")); // the name under which answers are given
  readonly tokenAsked = signal(false); // whether the viewer refused this page's token
  readonly scale = signal(1); // of the diagram
  /** Whether names of states, or labels of arrows where there are any, have less than 11 px. */
  readonly textIsSmall = computed(() => this.scale.value < (this.overview.value ? SMALL.names : SMALL.labels));
  readonly treeOpen = signal(false); // on small screens, where the tree covers the page
  readonly outline = signal(false); // whether the user wants tiles without arrows, with larger names
  readonly overview = signal(false); // whether states are tiles without arrows, because many are open
  readonly laidOut: Signal<{ done: number; all: number } | null> = signal(null); // progress of a long layout [states]
  readonly dismissed: Signal<string | null> = signal(null); // the previous run whose notice was closed
  readonly pins: Signal<Set<string>> = signal(new Set(saved<string[]>("pins", []))); // ids of runs
  readonly chosenAction: Signal<string | null> = signal(null);
  readonly logFilter = signal("all");
  readonly laneFilter = signal(""); // names of lanes that the timeline shows
  readonly isPhone = signal(false); // whether there is room for only one part of the page
  readonly part = signal("machine"); // the part that a phone shows: machine, map, time or log
  readonly notice: Signal<{ text: string; kind: "info" | "error" } | null> = signal(null);
  #data: Data;
  #autoDepth = 0; // levels opened automatically; 0: the user has chosen
  #noticeTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(data: Data) {
    this.#data = data;
  }

  notify(text: string, kind: "info" | "error" = "info") {
    this.notice.value = { text, kind };
    clearTimeout(this.#noticeTimer);
    this.#noticeTimer = setTimeout(() => {
      this.notice.value = null;
    }, NOTICE_MS[kind]);
  }

  /** @param id of a run */
  togglePin(id: string) {
    const next = new Set(this.pins.value);
    if (!next.delete(id)) next.add(id);
    this.pins.value = next;
    save("pins", [...next]);
  }

  // -- the machine and its open containers ------------------------------------------------------

  setModel(payload: MachinePayload) {
    const next = new Model(payload, this.implicit.value);
    this.#data.model.value = next;
    if (payload !== this.#data.comparison.value?.model) this.#data.comparison.value = null;
    const known: string[] = saved<string[]>(`open.${next.root.label}`, []).filter(
      (path: string) => next.get(path)?.children.length,
    );
    this.outline.value = false;
    this.#autoDepth = known.length ? 0 : next.readableDepth();
    this.opened.value = this.#autoDepth ? next.toDepth(this.#autoDepth) : new Set(known);
  }

  setImplicit(on: boolean) {
    this.implicit.value = on;
    save("implicit", on);
    const model = this.#data.model.value;
    if (model) this.#data.model.value = new Model(model.payload, on);
  }

  /** Open one level less, unless the user has chosen; returns false if that is impossible. */
  openOneLevelLess() {
    const model = this.#data.model.value;
    if (this.#autoDepth < 2 || !model) return false;
    this.#autoDepth -= 1;
    this.opened.value = model.toDepth(this.#autoDepth);
    return true;
  }

  keepOpened(paths: Set<string>) {
    this.opened.value = paths;
    this.outline.value = false;
    this.#autoDepth = 0;
  }

  setOpened(paths: Set<string>) {
    this.keepOpened(paths);
    const model = this.#data.model.value;
    if (model) save(`open.${model.root.label}`, [...paths]);
  }

  /** Open only a state's container, with as many levels inside as are readable. */
  openAround(node: StateNode) {
    const model = this.#data.model.value;
    const top = node.children.length ? node : node.parent;
    if (!model || !top) return;
    const below = top.depth + model.readableDepth(AROUND, top);
    const inside = model.order.filter(
      (one) => one.children.length && one.depth < below && (one === top || one.path.startsWith(`${top.path}/`)),
    );
    this.follow.value = false;
    this.setOpened(new Set([...model.ancestors(top.path), ...inside].map((one) => one.path)));
  }

  toggle(path: string) {
    const next = new Set(this.opened.value);
    if (!next.delete(path)) next.add(path);
    this.follow.value = false;
    this.setOpened(next);
  }

  /** Open the containers around a state; returns false if all are open. */
  reveal(path: string) {
    const around = this.#data.model.value?.ancestors(path) ?? [];
    const closed = around.filter((node) => !this.opened.value.has(node.path));
    if (closed.length) this.setOpened(new Set([...this.opened.value, ...closed.map((node) => node.path)]));
    return closed.length > 0;
  }
}
