// The causes of a run's end as a picture to pass on: what happened, the diagram, the map, and which run it was.

import { messageOf } from "#core/requests.ts";
import { saveFile } from "#core/share.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Why } from "#core/types.ts";
import { pictureOf, styleText } from "#drawing/film.ts";
import type { Page } from "#drawing/page.ts";
import { FONT } from "#drawing/theme.ts";

const WIDTH = 800; // [px]
const EDGE = 24;
const LINE = 24;
const MOST_STEPS = 6;
const FONTS_MS = 150; // until then the font of the first picture may not be loaded

/** Copy the card as a picture; where a browser copies none, it is saved. */
export async function copyCard(page: Page, why: Why) {
  try {
    const canvas = await draw(page, why);
    const blob = await new Promise<Blob | null>((done) => canvas.toBlob(done, "image/png"));
    if (!blob) throw new Error("this browser makes no picture of it");
    try {
      await navigator.clipboard.write([new ClipboardItem({ "image/png": blob })]);
      store.view.notify("Copied");
    } catch {
      saveFile(blob, `${page.fileName()}.png`);
    }
  } catch (error) {
    store.view.notify(`No card: ${messageOf(error)}`, "error");
  }
}

async function draw(page: Page, why: Why) {
  const { svg } = page.diagram;
  const floor = page.map.canvas;
  const style = await styleText();
  await pictureOf(svg, style);
  await new Promise((done) => setTimeout(done, FONTS_MS));
  const diagram = await pictureOf(svg, style);
  const wide = WIDTH - 2 * EDGE;
  const tall = (from: { clientWidth: number; clientHeight: number }) =>
    from.clientWidth ? Math.round((from.clientHeight * wide) / from.clientWidth) : 0;
  const steps = why.steps.slice(0, MOST_STEPS);
  const lines = steps.reduce((sum, { reason }) => sum + (reason ? 2 : 1), 0);
  const heights = { diagram: tall(svg), map: tall(floor) };
  const height = EDGE * 3 + LINE * (lines + 3) + heights.diagram + heights.map;
  const canvas = document.createElement("canvas");
  const ratio = 2; // sharp in documents
  Object.assign(canvas, { width: WIDTH * ratio, height: height * ratio });
  const g = canvas.getContext("2d") as CanvasRenderingContext2D;
  g.scale(ratio, ratio);
  const colour = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);
  const write = (text: string, x: number, y: number, font: string, ink: string, most = WIDTH - EDGE - x) => {
    g.font = font;
    g.fillStyle = colour(ink);
    let shown = text;
    while (shown.length > 4 && g.measureText(shown).width > most) shown = `${shown.slice(0, -2).trimEnd()}\u2026`;
    g.fillText(shown, x, y);
  };
  g.fillStyle = colour("background");
  g.fillRect(0, 0, WIDTH, height);
  g.textBaseline = "middle";
  let y = EDGE + LINE / 2;
  const outcome = why.outcome ?? "no end";
  write(`${page.title()}: ${outcome}`, EDGE, y, "680 18px Inter, Arial, sans-serif", "ink");
  y += LINE * 1.5;
  for (const step of steps) {
    const t = store.clock.runText(step.stamp_ns / 1e6, 1);
    write(t, EDGE, y, "600 12px 'JetBrains Mono', monospace", "muted");
    const text = `${store.data.nameOf(step.path)} ${shorten(step.what, 120)}`;
    write(text, EDGE + 80, y, "620 13px Inter, Arial, sans-serif", step.kind === "failure" ? "failure-text" : "ink");
    y += LINE;
    if (!step.reason) continue;
    write(shorten(step.reason, 160), EDGE + 80, y - 4, "12px Inter, Arial, sans-serif", "muted");
    y += LINE;
  }
  g.drawImage(diagram, EDGE, y, wide, heights.diagram);
  y += heights.diagram + EDGE / 2;
  if (heights.map) g.drawImage(floor, EDGE, y, wide, heights.map);
  const began = why.began === null ? "" : new Date(why.began / 1e6).toISOString().slice(0, 16).replace("T", " ");
  const about = `${store.data.facts.value?.name ?? ""}, began ${began}, made with smachpy`;
  write(about, EDGE, height - EDGE, FONT, "muted");
  return canvas;
}
