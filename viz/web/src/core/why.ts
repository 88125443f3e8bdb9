// The causes of a run's end, from `smachpy_viz.model.why`, for the diagram.

import type { Why } from "#core/types.ts";
/** The ends of states from the first cause to the outcome, each once. */
export function wayOf(why: Why | null) {
  const ends = new Map();
  for (const { path, outcome } of why?.steps ?? []) if (outcome) ends.set(`${path} ${outcome}`, { path, outcome });
  return [...ends.values()];
}
