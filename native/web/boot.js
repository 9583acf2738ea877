// SPDX-License-Identifier: MIT
// Unpacks the viewer and runs it. It is embedded unchanged in the page and in scripts for other pages.
(async () => {
  if (globalThis.customElements.get("risorius-face")) return;
  const faces = globalThis.risoriusFaces; // set by scripts; another page may have its own #viewer
  const text = faces ? Object.values(faces)[0].files.viewer : document.getElementById("viewer").textContent;
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.head.append(script);
})().catch((error) => document.body.append(`This browser cannot show the face: ${error.message}`));
