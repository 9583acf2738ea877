// SPDX-License-Identifier: MIT
// The output of `risorius web`: one table and files as text. They are embedded in the page, or in a
// script for other pages. See native/python/risorius/web/page.py.

async function unpacked(text) {
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The face embedded in elements of this page. */
export const inPage = {
  get table() {
    return JSON.parse(document.getElementById("face-table").textContent);
  },
  /** Bytes of an element, or null if the page has none of this name. */
  async bytes(id) {
    const element = document.getElementById(id);
    if (element === null) return null;
    const found = await unpacked(element.textContent);
    element.remove(); // frees the text of a large face
    return found;
  },
};

/** A face from a script. In: {table, files}. */
export const inScript = ({ table, files }) => ({
  table,
  bytes: async (id) => (id in files ? unpacked(files[id]) : null),
});
