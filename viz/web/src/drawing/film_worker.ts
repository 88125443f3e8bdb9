// Encodes the pictures of a film, in a worker of its own: it takes most of the time.
import { applyPalette, GIFEncoder, quantize } from "gifenc";

export type Picture = { width: number; height: number; data: Uint8ClampedArray };
export type Told = { frameMs: number } | Picture | "end";

const COLOURS = 255; // a GIF has 256: one is transparent

/**
 * Make the pixels transparent that are as in the picture before; returns whether any pixel has changed.
 * @param indexes in the palette
 * @param transparent index
 */
export function keepUnchanged(now: Uint32Array, before: Uint32Array, indexes: Uint8Array, transparent: number) {
  let isOther = false;
  for (let i = 0; i < now.length; i++)
    if (now[i] === before[i]) indexes[i] = transparent;
    else isOther = true;
  return isOther;
}

export class Encoder {
  #before: Uint32Array | null = null;
  #due = 0; // duration of the waiting frame [frames]
  /** The frame before; how long it is shown is known when the picture changes. */
  #waiting: { index: Uint8Array; width: number; height: number; options: object } | null = null;
  readonly #gif = GIFEncoder();
  readonly #frameMs: number;

  constructor(frameMs: number) {
    this.#frameMs = frameMs;
  }

  add({ width, height, data }: Picture) {
    const pixels = new Uint32Array(data.buffer);
    const palette = quantize(data, COLOURS);
    const index = applyPalette(data, palette);
    if (this.#before === null || keepUnchanged(pixels, this.#before, index, palette.length)) {
      this.#write();
      const transparent = this.#before !== null;
      palette.push([0, 0, 0]);
      const options = { palette, transparent, transparentIndex: palette.length - 1, dispose: 1 };
      this.#waiting = { index, width, height, options };
      this.#due = 0;
    }
    this.#due += 1;
    this.#before = pixels;
  }

  #write() {
    if (!this.#waiting) return;
    const { index, width, height, options } = this.#waiting;
    this.#gif.writeFrame(index, width, height, { ...options, delay: this.#due * this.#frameMs });
  }

  end() {
    this.#write();
    this.#gif.finish();
    return this.#gif.bytes();
  }
}

let encoder: Encoder | null = null;

function take({ data: told }: MessageEvent<Told>) {
  if (told === "end") postMessage({ film: encoder?.end() });
  else if ("frameMs" in told) encoder = new Encoder(told.frameMs);
  else {
    encoder?.add(told);
    postMessage({ film: null });
  }
}

if ("WorkerGlobalScope" in globalThis) globalThis.onmessage = take;
