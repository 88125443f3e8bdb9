// The causes of a run's end, from `viz.model.why`, for the diagram.

/**
 * The ends of states from the first cause to the outcome, each once.
 * @param {Why | null} why
 */
export function wayOf(why) {
  const ends = new Map();
  for (const { path, outcome } of why?.steps ?? []) if (outcome) ends.set(`${path} ${outcome}`, { path, outcome });
  return [...ends.values()];
}
