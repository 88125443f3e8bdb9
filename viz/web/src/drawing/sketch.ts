// A sketch of a diagram on a canvas, for a machine with so many states that an image of the SVG takes seconds: the
// frames of the states, and those names that are large enough. Such a machine is drawn as tiles, without arrows.

import type { Diagram } from "#drawing/diagram.ts";
import type { View } from "#drawing/viewport.ts";

const LEAST = 6; // height of a name that is written [px]
const NAME = 11; // height of the name of a state without open ones in it, at scale 1 [px]

/**
 * Draw the states that are in a part of the canvas, which begins at its origin.
 * @param part its size [px]
 */
export function sketch(
  g: CanvasRenderingContext2D,
  diagram: Diagram,
  { x, y, k }: View,
  part: { w: number; h: number },
) {
  // States with the same classes look alike, so the browser is asked once for each look.
  const looks: Map<string, { fill: string; stroke: string; width: number; ink: string }> = new Map();
  g.save();
  g.beginPath();
  g.rect(0, 0, part.w, part.h);
  g.clip();
  g.translate(x, y);
  g.scale(k, k);
  for (const [path, { group, frame, node }] of diagram.picture.states) {
    const box = diagram.boxOf(path);
    const title = group.querySelector<SVGTextElement>(".title, .name");
    if (!box || !title) continue;
    const [left, top, w, h] = [box.x * k + x, box.y * k + y, box.w * k, box.h * k];
    if (left > part.w || top > part.h || left + w < 0 || top + h < 0) continue;
    const name = `${group.getAttribute("class")} ${node.depth}`;
    let look = looks.get(name);
    if (!look) {
      const { fill, stroke, strokeWidth } = getComputedStyle(frame);
      look = { fill, stroke, width: Number.parseFloat(strokeWidth), ink: getComputedStyle(title).fill };
      looks.set(name, look);
    }
    g.fillStyle = look.fill;
    g.fillRect(box.x, box.y, box.w, box.h);
    g.strokeStyle = look.stroke;
    g.lineWidth = look.width;
    g.strokeRect(box.x, box.y, box.w, box.h);
    const own = Number.parseFloat(title.style.fontSize); // of a tile with tiles in it
    if ((own || NAME) * k < LEAST) continue;
    g.fillStyle = look.ink;
    g.font = `620 ${own || NAME}px Inter, Arial, sans-serif`;
    g.textBaseline = own ? "middle" : "alphabetic";
    g.fillText(node.shown, Number(title.getAttribute("x")), Number(title.getAttribute("y")));
  }
  g.restore();
}
