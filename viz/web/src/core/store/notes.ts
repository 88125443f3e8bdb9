// The notes of the user on the run shown, kept in the browser.

import type { Signal } from "@preact/signals";
import { signal } from "@preact/signals";
import type { Note } from "#core/links.ts";
import { withNotes } from "#core/links.ts";
import { save, saved } from "#core/storage.ts";
import type { Data } from "#core/store/data.ts";
import type { Playback } from "#core/store/playback.ts";

const NOTED_RUNS = 30; // runs whose notes are kept in the browser

export class Notes {
  readonly all: Signal<Note[]> = signal([]);
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

  /** Load the notes of the machine shown. */
  load() {
    const { notes: kept } = notedRuns().find((one) => one?.epoch === this.#data.facts.value?.epoch) ?? {};
    this.all.value = Array.isArray(kept) ? kept : [];
  }

  add(more: Note[]) {
    this.#set(withNotes(this.all.value, more));
  }

  remove(note: Note) {
    this.#set(this.all.value.filter((one) => one !== note));
  }

  #set(next: Note[]) {
    const epoch = this.#data.facts.value?.epoch;
    this.all.value = next;
    if (!epoch) return;
    const others = notedRuns().filter((one) => one?.epoch !== epoch);
    save("notes", [...others, ...(next.length ? [{ epoch, notes: next }] : [])].slice(-NOTED_RUNS));
  }
}

function notedRuns(): { epoch: string; notes: Note[] }[] {
  const all = saved<{ epoch: string; notes: Note[] }[]>("notes", []);
  return Array.isArray(all) ? all : [];
}
