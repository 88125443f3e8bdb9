// The floor of the map: the cells of a grid map as a picture, or lines every metre where there is none.

import { bytesOf } from "#core/page_file.ts";
import { cellAt } from "#core/scene.ts";
import type { GridMap, Point } from "#core/types.ts";
import type { Colours } from "#drawing/theme.ts";

/** px per metre, and the pixels of the place (0, 0) */
export type MapScale = { k: number; left: number; bottom: number };

/** The pixel of a place. @param place [m] @returns [px] */
export const pixelOf = ({ k, left, bottom }: MapScale, { x, y }: Point): [number, number] => [
  left + x * k,
  bottom - y * k,
];

export const placeAt = ({ k, left, bottom }: MapScale, px: number, py: number): Point => ({
  x: (px - left) / k,
  y: (bottom - py) / k,
});

export class Floor {
  #colours: Colours;
  #onPicture: () => void;
  /** pictures of maps, by their cells and colours */
  #pictures: Map<string, HTMLCanvasElement> = new Map();

  /** @param onPicture called when a map was unpacked that could not be drawn before */
  constructor(colours: Colours, onPicture: () => void) {
    this.#colours = colours;
    this.#onPicture = onPicture;
  }

  /** Make the pictures anew. */
  forget() {
    this.#pictures.clear();
  }

  /** @param ratio of device pixels to CSS pixels */
  draw(g: CanvasRenderingContext2D, map: GridMap, scale: MapScale, ratio: number) {
    const picture = this.#picture(map);
    if (!picture) return;
    const cell = scale.k * map.resolution; // [px]
    const [x, y] = pixelOf(scale, cellAt(map, 0, 0));
    g.save();
    g.translate(x, y);
    g.rotate(-map.origin[2]);
    g.scale(cell, cell);
    g.imageSmoothingEnabled = cell * ratio < 2;
    g.imageSmoothingQuality = "high";
    g.drawImage(picture, 0, -map.height);
    g.restore();
  }

  /** A map as a picture; null while it is being unpacked. */
  #picture(map: GridMap) {
    const colours = ["floor", "wall", "unknown"].map((name) => this.#colours.of(name));
    const key = `${colours.join()} ${map.width} ${map.cells}`;
    const known = this.#pictures.get(key);
    if (known) return known.width ? known : null;
    const made = document.createElement("canvas");
    made.width = 0;
    this.#pictures.clear(); // older maps are not needed any more
    this.#pictures.set(key, made);
    bytesOf(map.cells)
      .then((cells) => {
        if (cells.length !== map.width * map.height) return; // a recording that was edited by hand
        paintCells(made, map, cells, colours.map(wordOf));
        this.#onPicture();
      })
      .catch(() => {}); // an invalid map: poses are shown without one
    return null;
  }

  /** Draw a grid of 1 m. */
  drawGrid(g: CanvasRenderingContext2D, scale: MapScale, width: number, height: number) {
    const step = scale.k > 6 ? 1 : 10;
    const from = placeAt(scale, 0, height);
    const to = placeAt(scale, width, 0);
    g.strokeStyle = this.#colours.of("hair-map");
    g.lineWidth = 1;
    g.beginPath();
    for (let x = Math.ceil(from.x / step) * step; x < to.x; x += step) {
      const [px] = pixelOf(scale, { x, y: 0 });
      g.moveTo(px, 0);
      g.lineTo(px, height);
    }
    for (let y = Math.ceil(from.y / step) * step; y < to.y; y += step) {
      const [, py] = pixelOf(scale, { x: 0, y });
      g.moveTo(0, py);
      g.lineTo(width, py);
    }
    g.stroke();
  }
}

/** @param shades pixels of a free, an occupied and an unknown cell */
function paintCells(canvas: HTMLCanvasElement, { width, height }: GridMap, cells: Uint8Array, shades: number[]) {
  Object.assign(canvas, { width, height });
  const g = canvas.getContext("2d") as CanvasRenderingContext2D;
  const image = g.createImageData(width, height);
  const words = new Uint32Array(image.data.buffer);
  for (let row = 0; row < height; row++)
    for (let i = 0, from = (height - 1 - row) * width; i < width; i++)
      words[row * width + i] = shades[cells[from + i]] ?? shades[2];
  g.putImageData(image, 0, 0);
}

/** A colour as a pixel. @param hex such as #1a2531 or #fff */
function wordOf(hex: string) {
  const full = hex.length === 4 ? [...hex.slice(1)].map((c) => c + c).join("") : hex.slice(1, 7);
  const [r, g, b] = [0, 2, 4].map((i) => Number.parseInt(full.slice(i, i + 2), 16));
  return ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;
}
