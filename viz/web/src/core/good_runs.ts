// A value of a run that failed among those of good runs, on a line.

import type { Fact } from "#core/wire.ts";

const MIDDLE = 0.8; // of the good values, in the box

export type Placed = { low: number; high: number; dots: number[]; box: [number, number]; here: number };

/** Places on a line [0 to 1]; null if there are no numbers. */
export function placed({ good, number }: Pick<Fact, "good" | "number">): Placed | null {
  if (number === null || !good.length) return null;
  const sorted = [...good].sort((a, b) => a - b);
  const [least, most] = [Math.min(sorted[0], number), Math.max(sorted[sorted.length - 1], number)];
  const margin = (most - least || Math.abs(most) || 1) * 0.08;
  const [low, high] = [least - margin, most + margin];
  const x = (value: number) => (value - low) / (high - low);
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))];
  const rest = (1 - MIDDLE) / 2;
  return { low: least, high: most, dots: sorted.map(x), box: [x(at(rest)), x(at(1 - rest))], here: x(number) };
}
