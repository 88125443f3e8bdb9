// Searches in lists.

/**
 * The number of entries at the beginning of a list for which a condition holds, by binary search: it must hold for no
 * entry behind one for which it does not.
 */
export function countWhile<T>(list: T[], holds: (entry: T) => boolean) {
  let low = 0;
  let high = list.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if (holds(list[mid])) low = mid + 1;
    else high = mid;
  }
  return low;
}

const parentOf = (path: string) => path.slice(0, Math.max(0, path.lastIndexOf("/")));

/** The entries whose path contains the path of no other entry. */
export function innermost<T>(list: T[], pathOf: (entry: T) => string) {
  const above = new Set<string>();
  for (const entry of list) {
    for (let path = parentOf(pathOf(entry)); path && !above.has(path); path = parentOf(path)) above.add(path);
  }
  return list.filter((one) => !above.has(pathOf(one)));
}
