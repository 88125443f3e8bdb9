// Why a run ended so, as `viz.model.why` finds it: what of it is drawn.

/**
 * The ends of states from the first cause to the outcome, each once.
 * @param {Why | null} why
 */
export function wayOf(why) {
  const ends = new Map();
  for (const { path, outcome } of why?.steps ?? []) if (outcome) ends.set(`${path} ${outcome}`, { path, outcome });
  return [...ends.values()];
}
