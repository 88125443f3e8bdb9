// Widths of texts, measured once.

let context: CanvasRenderingContext2D | null = null;
const widths: Map<string, number> = new Map();

/** @param size [px] */
export function measure(text: string, size: number = 11, bold: boolean = false) {
  const key = `${size}${bold ? "b" : ""}${text}`;
  const known = widths.get(key);
  if (known !== undefined) return known;
  context ??= document.createElement("canvas").getContext("2d") as CanvasRenderingContext2D;
  context.font = `${bold ? 600 : 400} ${size}px Inter, "Liberation Sans", Arial, sans-serif`;
  const width = Math.ceil(context.measureText(text).width) + 1;
  widths.set(key, width);
  return width;
}

/** The beginning of a text that fits into a width. */
export function fitting(text: string, width: number) {
  let short = text;
  while (short.length > 1 && measure(short, 10) > width) short = `${short.slice(0, -2)}\u2026`;
  return short;
}
