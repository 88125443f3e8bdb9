// All that a page knows and shows, in parts. Panels read their signals; the drawing reads `playback.shown()`.

import { batch } from "@preact/signals";
import { Clock } from "#core/store/clock.ts";
import { Data } from "#core/store/data.ts";
import { Notes } from "#core/store/notes.ts";
import { Panels } from "#core/store/panels.ts";
import { Playback } from "#core/store/playback.ts";
import { Pointer } from "#core/store/pointer.ts";
import { Status } from "#core/store/status.ts";
import { View } from "#core/store/view.ts";
import type { RunEvent, RunState } from "#core/types.ts";

export type Store = ReturnType<typeof createStore>;

export function createStore() {
  const data = new Data();
  const view = new View(data);
  const playback = new Playback(data, view);
  const status = new Status(data, playback);
  const pointer = new Pointer(data, playback);
  const clock = new Clock(data, playback);
  const panels = new Panels(data, playback, view);
  const notes = new Notes(data, playback);
  return {
    ...{ data, view, playback, status, pointer, clock, panels, notes },

    startRun(base: RunState | null, events: RunEvent[]) {
      batch(() => {
        data.startRun(base, events);
        playback.restart();
        pointer.hovered.value = null;
      });
    },

    /** Add new events to the run. */
    addEvents(events: RunEvent[]) {
      playback.forget(data.addEvents(events));
    },
  };
}

/** What this page knows and shows. */
export const store = createStore();
