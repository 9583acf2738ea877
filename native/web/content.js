// SPDX-License-Identifier: MIT
// What `risorius web` made: one table of words, and files as text. They stand in the page, or in a
// script for pages of others. See native/python/risorius/web/page.py.

async function unpacked(text) {
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The face that stands in this page's elements. */
export const inPage = {
  get table() {
    return JSON.parse(document.getElementById("face-table").textContent);
  },
  /** Bytes of an element, or null where the page has none of this name. */
  async bytes(id) {
    const element = document.getElementById(id);
    if (element === null) return null;
    const found = await unpacked(element.textContent);
    element.remove(); // the text of a large face need not be held twice
    return found;
  },
};

/** A face of a script. In: {table, files}. */
export const inScript = ({ table, files }) => ({
  table,
  bytes: async (id) => (id in files ? unpacked(files[id]) : null),
});
