// Saves a stretch of the run as a GIF: shows one instant after another and encodes a picture of the page for each.
import { applyPalette, GIFEncoder, quantize } from "gifenc";
import { messageOf } from "#core/connection.js";
import { FILM_FRAME_MS, framesOf, keepUnchanged } from "#core/playback.js";
import * as store from "#core/store.js";
import { isDark } from "#drawing/theme.js";

/** @typedef {import("#drawing/page.js").Page} Page */

const LAST_MS = 20_000; // length of the film if no stretch is selected
const WIDEST = 960; // [px]
const HEAD = 32; // height of the line with the machine's name and the instant [px]
const COLOURS = 255; // a GIF has 256: one is transparent
const FONTS_MS = 150; // until then the font of the first picture may not be loaded

/** Save a film of the selected stretch, otherwise of the last seconds before the instant shown. @param {Page} page */
export async function saveFilm(page) {
  const { run } = store;
  store.playing.value = null; // playing would change the instant between two pictures
  const shown = store.cursor.value;
  const to = store.nowMs();
  const stretch = store.stretch.value ?? { from: Math.max(run.first() ?? to, to - LAST_MS), to };
  if (store.filmed.value !== null || stretch.from >= stretch.to) return;
  const name = `${page.fileName()}.gif`;
  store.filmed.value = 0;
  try {
    const film = await draw(page, stretch, () => run === store.run);
    if (film) save(film, name);
  } catch (error) {
    store.notify(`No film: ${messageOf(error)}`, "error");
  } finally {
    store.filmed.value = null;
    if (run === store.run) store.seek(shown);
  }
}

/**
 * @param {Page} page
 * @param {import("#core/playback.js").Stretch} stretch
 * @param {() => boolean} isWanted whether the film is still wanted
 */
async function draw(page, stretch, isWanted) {
  const instants = framesOf(stretch);
  const style = await styleText();
  const gif = GIFEncoder();
  const canvas = document.createElement("canvas");
  const g = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  /** @type {Uint32Array | null} */
  let before = null;
  let due = 0; // duration of the waiting frame [frames]
  /** @type {{ index: Uint8Array, options: object } | null} */
  let waiting = null; // the frame before; how long it is shown is known when the picture changes
  const write = () => {
    const { width, height } = canvas;
    if (waiting) gif.writeFrame(waiting.index, width, height, { ...waiting.options, delay: due * FILM_FRAME_MS });
  };
  for (const [i, t] of instants.entries()) {
    if (!isWanted()) return null;
    store.seek(t);
    await paint(page, canvas, style, i === 0);
    const { data } = g.getImageData(0, 0, canvas.width, canvas.height);
    const pixels = new Uint32Array(data.buffer);
    const palette = quantize(data, COLOURS);
    const index = applyPalette(data, palette);
    const isOther = before === null || keepUnchanged(pixels, before, index, palette.length);
    if (isOther) {
      write();
      const transparent = before !== null;
      palette.push([0, 0, 0]);
      waiting = { index, options: { palette, transparent, transparentIndex: palette.length - 1, dispose: 1 } };
      due = 0;
    }
    due += 1;
    before = pixels;
    store.filmed.value = Math.round((100 * (i + 1)) / instants.length);
  }
  write();
  gif.finish();
  return new Blob([gif.bytes()], { type: "image/gif" });
}

/**
 * Paint the diagram as it is shown, with the map beside it and the timeline below, if they are shown.
 * @param {Page} page
 * @param {HTMLCanvasElement} canvas
 * @param {string} style
 * @param {boolean} isFirst
 */
async function paint(page, canvas, style, isFirst) {
  const { svg } = page.diagram;
  const [floor, timeline] = [page.map.canvas, page.timeline.canvas];
  const stage = { w: svg.clientWidth, h: svg.clientHeight };
  const wide = stage.w + floor.clientWidth;
  const below = timeline.clientWidth ? (timeline.clientHeight * wide) / timeline.clientWidth : 0;
  const scale = Math.min(1, WIDEST / wide);
  const [width, height] = [wide * scale, (HEAD + stage.h + below) * scale].map(Math.round);
  if (isFirst) Object.assign(canvas, { width, height });
  let picture = await pictureOf(svg, style);
  if (isFirst) {
    await new Promise((done) => setTimeout(done, FONTS_MS));
    picture = await pictureOf(svg, style);
  }
  const g = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const colour = (/** @type {string} */ name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  g.setTransform(1, 0, 0, 1, 0, 0);
  g.fillStyle = colour("--background");
  g.fillRect(0, 0, canvas.width, canvas.height);
  g.scale(scale, scale);
  g.fillStyle = colour("--ink");
  g.textBaseline = "middle";
  g.font = "660 15px Inter, Arial, sans-serif";
  g.fillText(page.title(), 12, HEAD / 2);
  g.textAlign = "right";
  g.font = "600 15px 'JetBrains Mono', monospace";
  g.fillText(store.instantText(store.nowMs()), wide - 12, HEAD / 2);
  g.textAlign = "left";
  g.drawImage(picture, 0, HEAD, stage.w, stage.h);
  if (floor.clientWidth) g.drawImage(floor, stage.w, HEAD, floor.clientWidth, floor.clientHeight);
  if (below) g.drawImage(timeline, 0, HEAD + stage.h, wide, below);
}

/** @param {SVGSVGElement} svg @param {string} style */
async function pictureOf(svg, style) {
  const copy = /** @type {SVGSVGElement} */ (svg.cloneNode(true));
  const [width, height] = [svg.clientWidth, svg.clientHeight];
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", String(width));
  copy.setAttribute("height", String(height));
  copy.dataset.theme = isDark() ? "dark" : "light";
  const sheet = document.createElementNS("http://www.w3.org/2000/svg", "style");
  sheet.textContent = `${style} svg.diagram { width: ${width}px; height: ${height}px; }`;
  copy.prepend(sheet);
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  return image;
}

/** The page's style with the diagram's font embedded: an SVG in an image cannot load files. */
async function styleText() {
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules].map((rule) => rule.cssText));
  const wanted = rules.filter((rule) => !rule.startsWith("@font-face") || rule.includes("Inter"));
  const text = wanted.join("\n");
  const [, address] = /url\("([^"]+inter\.woff2)"\)/.exec(text) ?? [];
  if (!address) return text; // a page in one file has the font embedded already
  const font = await (await fetch(address)).blob();
  const data = await new Promise((done) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result);
    reader.readAsDataURL(font);
  });
  return text.replace(address, data);
}

/** @param {Blob} content @param {string} name */
function save(content, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
