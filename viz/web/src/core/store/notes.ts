// The notes on the run shown: those that all pages share, and those of this browser, which may not write to the server.

import type { Signal } from "@preact/signals";
import { computed, signal } from "@preact/signals";
import type { Note } from "#core/links.ts";
import { withNotes } from "#core/links.ts";
import { save, saved } from "#core/storage.ts";
import type { Data } from "#core/store/data.ts";
import type { Playback } from "#core/store/playback.ts";

const NOTED_RUNS = 30; // runs whose notes are kept in the browser

export class Notes {
  readonly shared: Signal<Note[]> = signal([]);
  readonly own: Signal<Note[]> = signal([]);
  /** All of them, in the order of their instants. */
  readonly all = computed(() => withNotes(this.shared.value, this.own.value, Infinity));
  readonly writtenAt: Signal<number | null> = signal(null); // instant of the note that is being written [ms]
  #data: Data;
  #playback: Playback;

  constructor(data: Data, playback: Playback) {
    this.#data = data;
    this.#playback = playback;
  }

  /** Begin a note on the instant shown. */
  begin() {
    if (this.#data.run.first() !== null) this.writtenAt.value = this.#playback.nowMs();
  }

  /** Load this browser's notes on the machine shown. */
  load() {
    const { notes: kept } = notedRuns().find((one) => one?.epoch === this.#data.facts.value?.epoch) ?? {};
    this.own.value = Array.isArray(kept) ? kept : [];
  }

  /** Add notes to those of this browser. */
  add(more: Note[]) {
    this.#set(withNotes(this.own.value, more));
  }

  /** Remove one of this browser's. */
  remove({ at, text }: Note) {
    this.#set(this.own.value.filter((one) => one.at !== at || one.text !== text));
  }

  #set(next: Note[]) {
    const epoch = this.#data.facts.value?.epoch;
    this.own.value = next;
    if (!epoch) return;
    const others = notedRuns().filter((one) => one?.epoch !== epoch);
    save("notes", [...others, ...(next.length ? [{ epoch, notes: next }] : [])].slice(-NOTED_RUNS));
  }
}

function notedRuns(): { epoch: string; notes: Note[] }[] {
  const all = saved<{ epoch: string; notes: Note[] }[]>("notes", []);
  return Array.isArray(all) ? all : [];
}
