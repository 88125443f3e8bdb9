// Widths of texts, measured once.

/** @type {CanvasRenderingContext2D | null} */
let context = null;
/** @type {Map<string, number>} */
const widths = new Map();

/** @param {string} text @param {number} [size] [px] @param {boolean} [bold] */
export function measure(text, size = 11, bold = false) {
  const key = `${size}${bold ? "b" : ""}${text}`;
  const known = widths.get(key);
  if (known !== undefined) return known;
  context ??= /** @type {CanvasRenderingContext2D} */ (document.createElement("canvas").getContext("2d"));
  context.font = `${bold ? 600 : 400} ${size}px Inter, "Liberation Sans", Arial, sans-serif`;
  const width = Math.ceil(context.measureText(text).width) + 1;
  widths.set(key, width);
  return width;
}
