// Encodes the pictures of a film, in a worker of its own: it takes most of the time.
import { applyPalette, GIFEncoder, quantize } from "gifenc";
import {
  BufferTarget,
  getFirstEncodableVideoCodec,
  Mp4OutputFormat,
  Output,
  QUALITY_HIGH,
  VideoSample,
  VideoSampleSource,
} from "mediabunny";

export type Kind = "gif" | "video";
export type Picture = { width: number; height: number; data: Uint8ClampedArray<ArrayBuffer> };
export type Film = { data: ArrayBuffer; type: "image/gif" | "video/mp4" };
export type Told = { kind: Kind; frameMs: number } | Picture | "end";
export type Answer = { film: Film | null } | { error: string };

/** Encodes one film. */
interface Encoder {
  add(picture: Picture): void | Promise<void>;
  end(): Film | Promise<Film>;
}

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

export class Gif implements Encoder {
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
    return { data: this.#gif.bytes().buffer, type: "image/gif" as const };
  }
}

/** An MP4: with H.264, which all programs play, where the browser can encode it. */
class Video implements Encoder {
  #made: { output: Output<Mp4OutputFormat, BufferTarget>; source: VideoSampleSource } | null = null;
  #count = 0;
  readonly #frameS: number;

  constructor(frameMs: number) {
    this.#frameS = frameMs / 1000;
  }

  async #begin(width: number, height: number) {
    const codec = await getFirstEncodableVideoCodec(["avc", "vp9", "av1"], { width, height });
    if (!codec) throw new Error("this browser encodes none of H.264, VP9 and AV1; save a GIF");
    const output = new Output({ format: new Mp4OutputFormat(), target: new BufferTarget() });
    const source = new VideoSampleSource({ codec, bitrate: QUALITY_HIGH });
    output.addVideoTrack(source);
    await output.start();
    return { output, source };
  }

  async add({ data, width, height }: Picture) {
    this.#made ??= await this.#begin(width, height);
    const place = { timestamp: this.#count * this.#frameS, duration: this.#frameS };
    const sample = new VideoSample(data, { format: "RGBX", codedWidth: width, codedHeight: height, ...place });
    this.#count += 1;
    await this.#made.source.add(sample);
    sample.close();
  }

  async end(): Promise<Film> {
    if (!this.#made) throw new Error("it has no pictures");
    const { output } = this.#made;
    await output.finalize();
    if (!output.target.buffer) throw new Error("the encoder gave nothing");
    return { data: output.target.buffer, type: "video/mp4" };
  }
}

let encoder: Encoder | null = null;

/** Tell the page the film at its end, null for each picture before. */
async function take(told: Told): Promise<Film | null> {
  if (told === "end") return (await encoder?.end()) ?? null;
  if ("kind" in told) encoder = told.kind === "gif" ? new Gif(told.frameMs) : new Video(told.frameMs);
  else await encoder?.add(told);
  return null;
}

if ("WorkerGlobalScope" in globalThis)
  globalThis.onmessage = ({ data }: MessageEvent<Told>) => {
    take(data).then(
      (film) => postMessage({ film }, film ? { transfer: [film.data] } : {}),
      (error) => postMessage({ error: String(error?.message ?? error) }),
    );
  };
