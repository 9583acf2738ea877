// SPDX-License-Identifier: MIT
// What `risorius web` put into the page: one table of words, and files as base64.

/** The table: see native/python/risorius/web/page.py. */
export function table() {
  return JSON.parse(document.getElementById("face-table").textContent);
}

/** Bytes of an element, or null where the page has none of this name. */
export async function bytes(id) {
  const element = document.getElementById(id);
  if (element === null) return null;
  const packed = Uint8Array.from(atob(element.textContent.trim()), (c) => c.charCodeAt(0));
  element.remove(); // the text of a large face need not be held twice
  if (element.dataset.packed !== "gzip") return packed;
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
