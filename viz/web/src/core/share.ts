// What the user takes out of the page: texts for the clipboard, files to save.

import { store } from "#core/store.ts";

/**
 * Copy a text, and say so.
 * @param told what is said then
 * @param otherwise what to do in a browser that lets no page copy
 */
export async function copyText(text: string, told = "Copied", otherwise = "mark the text and copy it") {
  try {
    await navigator.clipboard.writeText(text);
    store.view.notify(told);
  } catch {
    store.view.notify(`This browser lets no page copy here: ${otherwise}`, "error");
  }
}

const KEPT_MS = 10_000; // time for the browser to begin to save a file

export function saveFile(content: Blob, name: string) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), KEPT_MS);
}
