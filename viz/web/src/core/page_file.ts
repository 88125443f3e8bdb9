// The page as a file that contains its run: what such a page has packed in its elements.

/** Whether this page is a file that contains its run. */
export const isFile = () => document.getElementById("run-data") !== null;

/** The text in an element. @param id of an element with gzip data in base64 */
export async function unpack(id: string) {
  const text = document.getElementById(id)?.textContent ?? "";
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).text();
}

/** The bytes of zlib data in base64. */
export async function bytesOf(text: string) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

/** Start a worker: a file of the server, or a part of this page if that is a file. */
export async function makeWorker(name: "elk" | "film") {
  if (!isFile()) return new Worker(`/${name}-worker.js`);
  const code = await unpack(`${name}-data`);
  return new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
}
