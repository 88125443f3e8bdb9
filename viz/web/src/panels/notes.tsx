// Notes at instants of the run, and the link that shows this view to somebody else.

import { useState } from "preact/hooks";
import { isFile } from "#core/page_file.ts";
import { encoded, link } from "#core/requests.ts";
import { copyText } from "#core/share.ts";
import { addNote, isShared, removeNote } from "#core/shared_notes.ts";
import { store } from "#core/store.ts";
import { makesVideos, saveFilm } from "#drawing/film.ts";
import type { Page } from "#drawing/page.ts";
import { Dialog, fieldValue, Section } from "#panels/components.tsx";

export function ShareButtons({ page }: { page: Page }) {
  const told = isFile() ? "Link copied, for who has this file" : "Link copied";
  const copy = () => copyText(page.address.text, told, "the address bar shows the link");
  const share = () => {
    const saved = document.createElement("a");
    saved.href = link("export", `&format=html&view=${encoded(page.address.fragment)}`);
    saved.download = "";
    saved.click();
  };
  const done = store.playback.filmed.value;
  const films = [["gif", "GIF"] as const, ...(makesVideos() ? [["video", "Video"] as const] : [])];
  const stop = () => {
    store.playback.filmed.value = null;
  };
  return (
    <span class="share">
      {done === null ? (
        films.map(([kind, name]) => (
          <button
            key={kind}
            class="film"
            title={`${name} of the selected stretch, or of the 20 s before the instant shown`}
            onClick={() => saveFilm(page, kind)}
          >
            {name}
          </button>
        ))
      ) : (
        <button class="on" title="stop" onClick={stop}>
          {done} % ✕
        </button>
      )}
      <button title="note at the instant shown (n)" onClick={() => store.notes.begin()}>
        Note
      </button>
      <button
        title="copy the address of this view: instant, selection, open containers, notes of this browser"
        onClick={copy}
      >
        Link
      </button>
      {!isFile() && (
        <button title="one HTML file that opens at this instant, with the notes, without a server" onClick={share}>
          Share
        </button>
      )}
    </span>
  );
}

export function NoteDialog() {
  const [text, setText] = useState("");
  const at = store.notes.writtenAt.value;
  if (at === null) return null;
  const close = () => {
    store.notes.writtenAt.value = null;
    setText("");
  };
  const onSubmit = (e: Event) => {
    e.preventDefault();
    addNote({ at, text: text.trim() });
    close();
  };
  return (
    <Dialog label="note" class="note-form" onClose={close}>
      <form onSubmit={onSubmit}>
        <h2>Note at {store.clock.instantText(at)}</h2>
        <input
          aria-label="note"
          maxlength={300}
          autocomplete="off"
          value={text}
          autofocus
          onInput={(e: Event) => setText(fieldValue(e))}
        />
        <p class="hint">
          {isShared()
            ? "All pages of this run show it."
            : isFile()
              ? "This page forgets it."
              : "Only this browser keeps it; with the token for commands, all pages of this run show it."}
        </p>
        <p>
          <button class="primary" type="submit" disabled={!text.trim()}>
            Pin it
          </button>{" "}
          <button type="button" onClick={close}>
            Cancel
          </button>
        </p>
      </form>
    </Dialog>
  );
}

/** The notes of the run; a click on one goes to its instant. */
export function Notes() {
  const notes = store.notes.all.value;
  if (!notes.length) return null;
  return (
    <Section title="Notes" count={notes.length}>
      <ul class="notes">
        {notes.map((note) => (
          <li key={`${note.at} ${note.text}`}>
            <button class="link" onClick={() => store.playback.seek(note.at)}>
              <time>{store.clock.instantText(note.at)}</time>
            </button>
            <span title={note.by ? `by ${note.by}` : "only in this browser"}>{note.text}</span>
            {(note.by === undefined || isShared()) && (
              <button class="small" aria-label={`remove the note ${note.text}`} onClick={() => removeNote(note)}>
                ✕
              </button>
            )}
          </li>
        ))}
      </ul>
    </Section>
  );
}
