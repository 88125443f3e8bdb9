// The notes that all pages of a run share: the server keeps them, beside the recording if there is one.

import type { Note } from "#core/links.ts";
import { isFile } from "#core/page_file.ts";
import { ask, hasToken, isFailure, link, post } from "#core/requests.ts";
import { store } from "#core/store.ts";
import type { Answers, RunNote } from "#core/wire.ts";

/** The notes of the server as those of the page. */
export const notesOf = (notes: RunNote[]): Note[] =>
  notes.map(({ stamp_ns, text, by }) => ({ at: stamp_ns / 1e6, text, by }));

/** Read the shared notes on the machine shown. */
export async function readNotes() {
  if (isFile()) return;
  const machine = store.data.facts.value;
  const answer = await ask<Answers["GET /api/notes"]>(link("notes"));
  const { name, epoch } = store.data.facts.value ?? {};
  if (name !== machine?.name || epoch !== machine?.epoch) return; // another one is shown by now
  if (isFailure(answer)) store.view.notify(`Notes: ${answer.text}`, "error");
  store.notes.shared.value = isFailure(answer) ? [] : notesOf(answer);
}

/** Add a note for all pages; one that may not write to the server keeps it in its browser. */
export const addNote = (note: Note) => (isShared() ? change("add", note) : store.notes.add([note]));

/** Remove a note. */
export const removeNote = (note: Note) => (note.by === undefined ? store.notes.remove(note) : change("remove", note));

/** Whether a note of this page is for all pages. */
export const isShared = () => hasToken() && !isFile();

async function change(what: "add" | "remove", { at, text }: Note) {
  const by = store.view.operator.value.trim() || undefined;
  const note = { stamp_ns: Math.round(at * 1e6), text, ...(by && { by }) };
  const answer = await post<Answers["POST /api/notes"]>(link("notes"), { command: what, note });
  if (answer.ok) await readNotes();
  else if (!answer.wants_token) store.view.notify(`Note: ${answer.text}`, "error");
}
