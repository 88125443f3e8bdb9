// Searches in lists.

/**
 * The number of entries at the beginning of a list for which a condition holds, by binary search: it must hold for no
 * entry behind one for which it does not.
 * @template T
 * @param {T[]} list
 * @param {(entry: T) => boolean} holds
 */
export function countWhile(list, holds) {
  let low = 0;
  let high = list.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if (holds(list[mid])) low = mid + 1;
    else high = mid;
  }
  return low;
}

/**
 * The entries whose path contains the path of no other entry.
 * @template T
 * @param {T[]} list
 * @param {(entry: T) => string} pathOf
 */
export const innermost = (list, pathOf) =>
  list.filter((one) => !list.some((other) => pathOf(other).startsWith(`${pathOf(one)}/`)));
