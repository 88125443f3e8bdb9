// Saves a stretch of the run as a GIF or video: shows one instant after another and encodes a picture of the page for
// each.

import { makeWorker } from "#core/page_file.ts";
import type { Stretch } from "#core/playback.ts";
import { FILM_FRAME_MS, framesOf } from "#core/playback.ts";
import { messageOf } from "#core/requests.ts";
import { saveFile } from "#core/share.ts";
import { store } from "#core/store.ts";
import type { Answer, Film, Kind, Told } from "#drawing/film_worker.ts";
import type { Page } from "#drawing/page.ts";
import { sketch } from "#drawing/sketch.ts";
import { isDark } from "#drawing/theme.ts";

const LAST_MS = 20_000; // length of the film if no stretch is selected
const WIDEST = 960; // [px]
const HEAD = 32; // height of the line with the machine's name and the instant [px]
const FONTS_MS = 150; // until then the font of the first picture may not be loaded
const MOST_IN_IMAGE = 1000; // states; an image of more takes longer than a second

const SUFFIXES: Record<Film["type"], string> = { "image/gif": "gif", "video/mp4": "mp4" };

/** Whether this browser can encode a video; over http, most can only for a viewer of the same computer. */
export const makesVideos = () => "VideoEncoder" in globalThis;

/** Save a film of the selected stretch, otherwise of the last seconds before the instant shown. */
export async function saveFilm(page: Page, kind: Kind) {
  const { run } = store.data;
  store.playback.playing.value = null; // playing would change the instant between two pictures
  const shown = store.playback.cursor.value;
  const to = store.playback.nowMs();
  const stretch = store.playback.stretch.value ?? { from: Math.max(run.first() ?? to, to - LAST_MS), to };
  if (store.playback.filmed.value !== null || stretch.from >= stretch.to) return;
  const name = page.fileName();
  store.playback.filmed.value = 0;
  try {
    const film = await draw(page, kind, stretch, () => run === store.data.run && store.playback.filmed.value !== null);
    if (film) saveFile(new Blob([film.data], { type: film.type }), `${name}.${SUFFIXES[film.type]}`);
  } catch (error) {
    store.view.notify(`No film: ${messageOf(error)}`, "error");
  } finally {
    store.playback.filmed.value = null;
    if (run === store.data.run) store.playback.seek(shown);
  }
}

/** @param isWanted whether the film is still wanted */
async function draw(page: Page, kind: Kind, stretch: Stretch, isWanted: () => boolean) {
  const instants = framesOf(stretch);
  const style = await styleText();
  const canvas = document.createElement("canvas");
  const g = canvas.getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;
  const worker = await makeWorker("film");
  const ask = (told: Told, transfer: Transferable[] = []) =>
    new Promise<Film | null>((done, failed) => {
      worker.onmessage = ({ data }: MessageEvent<Answer>) =>
        "error" in data ? failed(new Error(data.error)) : done(data.film);
      worker.onerror = (e) => failed(new Error(e.message || "the encoder cannot be started"));
      worker.postMessage(told, transfer);
    });
  try {
    await ask({ kind, frameMs: FILM_FRAME_MS });
    for (const [i, t] of instants.entries()) {
      if (!isWanted()) return null;
      store.playback.seek(t);
      await paint(page, canvas, style, i === 0);
      const { data, width, height } = g.getImageData(0, 0, canvas.width, canvas.height);
      await ask({ data, width, height }, [data.buffer]);
      if (isWanted()) store.playback.filmed.value = Math.round((100 * (i + 1)) / instants.length);
    }
    return await ask("end");
  } finally {
    worker.terminate();
  }
}

/** Paint the diagram as it is shown, with the map beside it and the timeline below, if they are shown. */
async function paint(page: Page, canvas: HTMLCanvasElement, style: string, isFirst: boolean) {
  const { svg } = page.diagram;
  const [floor, timeline] = [page.map.canvas, page.timeline.canvas];
  const stage = { w: svg.clientWidth, h: svg.clientHeight };
  const wide = stage.w + floor.clientWidth;
  const below = timeline.clientWidth ? (timeline.clientHeight * wide) / timeline.clientWidth : 0;
  const scale = Math.min(1, WIDEST / wide);
  // Encoders of videos take even numbers only.
  const [width, height] = [wide * scale, (HEAD + stage.h + below) * scale].map((size) => 2 * Math.round(size / 2));
  if (isFirst) Object.assign(canvas, { width, height });
  const isLarge = page.diagram.picture.states.size > MOST_IN_IMAGE;
  let picture = isLarge ? null : await pictureOf(svg, style);
  if (picture && isFirst) {
    await new Promise((done) => setTimeout(done, FONTS_MS));
    picture = await pictureOf(svg, style);
  }
  const g = canvas.getContext("2d") as CanvasRenderingContext2D;
  const colour = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(name);
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
  g.fillText(store.clock.instantText(store.playback.nowMs()), wide - 12, HEAD / 2);
  g.textAlign = "left";
  if (picture) g.drawImage(picture, 0, HEAD, stage.w, stage.h);
  else {
    g.translate(0, HEAD);
    sketch(g, page.diagram, page.view, stage);
    g.translate(0, -HEAD);
  }
  if (floor.clientWidth) g.drawImage(floor, stage.w, HEAD, floor.clientWidth, floor.clientHeight);
  if (below) g.drawImage(timeline, 0, HEAD + stage.h, wide, below);
}

export async function pictureOf(svg: SVGSVGElement, style: string) {
  const copy = svg.cloneNode(true) as SVGSVGElement;
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
export async function styleText() {
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules].map((rule) => rule.cssText));
  const wanted = rules.filter((rule) => !rule.startsWith("@font-face") || rule.includes("Inter"));
  const text = wanted.join("\n");
  const [, address] = /url\("([^"]+inter\.woff2)"\)/.exec(text) ?? [];
  if (!address) return text; // a page in one file has the font embedded already
  const font = await (await fetch(address)).blob();
  const data = await new Promise<string>((done) => {
    const reader = new FileReader();
    reader.onload = () => done(String(reader.result));
    reader.readAsDataURL(font);
  });
  return text.replace(address, data);
}
