// Light or dark, by the system's setting or the user's choice.
import { save } from "#core/storage.ts";
import { store } from "#core/store.ts";

export const FONT = "11px Inter, Arial, sans-serif"; // of names in canvases

export const systemIsDark = matchMedia("(prefers-color-scheme: dark)");

export const isDark = () =>
  store.view.theme.value === "system" ? systemIsDark.matches : store.view.theme.value === "dark";

export function applyTheme() {
  if (store.view.theme.value === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = store.view.theme.value;
  save("theme", store.view.theme.value);
}

/** The page's present colours by name; read once, as getComputedStyle is slow. */
export class Colours {
  #known: Map<string, string> = new Map();

  of(name: string) {
    const known = this.#known.get(name);
    if (known !== undefined) return known;
    const colour = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    this.#known.set(name, colour);
    return colour;
  }

  /** Read them again. */
  forget() {
    this.#known.clear();
  }
}

/** Give a canvas the device pixels of its size, with CSS pixels as its unit; returns null if it is not shown. */
export function fitted(g: CanvasRenderingContext2D) {
  const { canvas } = g;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width || !height) return null;
  const ratio = devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { width, height, ratio };
}
