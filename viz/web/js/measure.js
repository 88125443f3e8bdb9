// Widths of texts, measured once.
const context = document.createElement("canvas").getContext("2d");
const widths = new Map();

export function measure(text, size = 11, bold = false) {
  const key = `${size}${bold ? "b" : ""}${text}`;
  let width = widths.get(key);
  if (width === undefined) {
    context.font = `${bold ? 600 : 400} ${size}px Inter, "Liberation Sans", Arial, sans-serif`;
    width = Math.ceil(context.measureText(text).width) + 1;
    widths.set(key, width);
  }
  return width;
}
