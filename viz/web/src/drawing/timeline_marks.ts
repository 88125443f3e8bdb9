// What lies over the lanes of the timeline: outages, folded idle times, notes; and what a bar says.

import type { Axis, Idle } from "#core/idle.ts";
import { purposeOfVisit } from "#core/purposes.ts";
import { pins } from "#core/reproduction.ts";
import { store } from "#core/store.ts";
import { askerText, duration } from "#core/text.ts";
import type { Span } from "#core/types.ts";
import { clipped } from "#drawing/bars.ts";
import type { Colours } from "#drawing/theme.ts";

const NOTE = 130; // width of a note's text [px]

/** Draw the outages; returns where they are [px]. */
export function drawOutages(g: CanvasRenderingContext2D, colours: Colours, axis: Axis, height: number) {
  const gaps: [number, number][] = [];
  for (const [begin, end] of store.data.run.now.outages ?? []) {
    if (end / 1e6 < axis.from || begin / 1e6 > axis.to) continue;
    const left = Math.max(axis.left, axis.x(begin / 1e6));
    const right = Math.min(axis.right, Math.max(axis.x(end / 1e6), left + 3));
    if (right <= left) continue;
    gaps.push([left, right]);
    g.fillStyle = colours.of("background");
    g.fillRect(left, 0, right - left, height);
    g.strokeStyle = colours.of("waiting");
    g.lineWidth = 1.5;
    g.setLineDash([2, 3]);
    for (const px of [left, right]) {
      g.beginPath();
      g.moveTo(px, 0);
      g.lineTo(px, height);
      g.stroke();
    }
    g.setLineDash([]);
    const text = duration((end - begin) / 1e9);
    if (g.measureText(text).width + 8 > right - left || axis.foldAt((left + right) / 2)) continue;
    g.fillStyle = colours.of("waiting-text");
    g.textAlign = "center";
    g.fillText(text, (left + right) / 2, 10);
  }
  return gaps;
}

/** Draw a folded idle time: a zigzag with its length, which a click unfolds. */
export function drawFold(
  g: CanvasRenderingContext2D,
  colours: Colours,
  { from, to }: Idle,
  axis: Axis,
  height: number,
) {
  const left = Math.max(axis.left, axis.x(from));
  const right = Math.min(axis.right, axis.x(to));
  const middle = (left + right) / 2;
  g.fillStyle = colours.of("depth2");
  g.fillRect(left, 0, right - left, height);
  g.strokeStyle = colours.of("muted");
  g.lineWidth = 1.2;
  g.beginPath();
  for (let y = 0, side = -1; y <= height; y += 5, side = -side) g.lineTo(middle + 3 * side, y);
  g.stroke();
  const text = duration((to - from) / 1000);
  const half = g.measureText(text).width / 2 + 5;
  const at = Math.max(axis.left + half, Math.min(axis.right - half, middle));
  g.beginPath();
  g.roundRect(at - half, height / 2 - 9, 2 * half, 18, 9);
  g.fillStyle = colours.of("background");
  g.fill();
  g.stroke();
  g.fillStyle = colours.of("ink");
  g.textAlign = "center";
  g.fillText(text, at, height / 2 + 0.5);
}

/** Draw a pin at each note, with its text. */
export function drawNotes(g: CanvasRenderingContext2D, colours: Colours, axis: Axis, height: number) {
  const { left: first, right: last } = axis;
  for (const { at, text } of pins()) {
    const px = axis.x(at);
    if (px < first || px > last) continue;
    g.fillStyle = colours.of("ink");
    g.fillRect(px - 0.5, 0, 1, height);
    const wide = Math.min(NOTE, g.measureText(text).width + 10);
    const left = px + wide > last ? px - wide : px;
    const top = height - 16;
    g.beginPath();
    g.roundRect(left, top, wide, 15, 3);
    g.fill();
    g.fillStyle = colours.of("background");
    g.textAlign = "left";
    clipped(g, left, top, wide - 4, 15, () => g.fillText(text, left + 5, top + 8));
  }
}

/** A visit as text. */
export function describe(span: Span) {
  const { from, to, preempt, serviced, abandoned } = span;
  const purpose = purposeOfVisit(span);
  const seconds = (some: number) => `${(some / 1000).toFixed(3)} s`;
  const lines = [
    purpose ? `${span.path} \u2192 ${purpose}` : span.path,
    to === null ? "runs" : `${seconds(to - from)}, ${span.outcome ?? "its end is unknown"}`,
  ];
  if (span.attempt) lines.push(`attempt ${span.attempt}`);
  if (preempt !== null) {
    lines.push(`asked to stop after ${seconds(preempt - from)} by ${askerText(span.asked) ?? "?"}`);
    if (serviced !== null) lines.push(`preempt serviced ${seconds(serviced - preempt)} later`);
    if (abandoned !== null) lines.push(`abandoned ${seconds(abandoned - preempt)} later`);
  }
  return lines.join("\n");
}
