# SPDX-License-Identifier: MIT
"""The HTML page's style sheet, and the script that enlarges a drawing."""

STYLE = """
:root { color-scheme: light dark; --ink: #1d232b; --muted: #66707d; --rule: #d4dae1;
  --accent: #4076b8; --paper: #ffffff; --desk: #f3f5f7; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8ecf0; --muted: #9aa5b1;
  --rule: #3a434d; --accent: #6fa3dd; --paper: #1c2127; --desk: #14181c; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--desk); color: var(--ink);
  font: 16px/1.5 system-ui, "Segoe UI", "Noto Sans", sans-serif; }
header, main, footer { max-width: 1240px; margin: 0 auto; padding: 0 24px; }
header { padding-top: 40px; }
h1 { font-size: 2.2rem; line-height: 1.15; margin: 0 0 4px; overflow-wrap: anywhere; }
header p { color: var(--muted); margin: 0 0 12px; overflow-wrap: anywhere; }
nav a { color: var(--accent); text-decoration: none; margin-right: 14px; }
nav a:hover { text-decoration: underline; }
.legend { position: sticky; top: 0; z-index: 1; list-style: none; display: flex; flex-wrap: wrap;
  justify-content: center; gap: 4px 20px; margin: 20px 0 0; padding: 10px 24px; font-size: .9rem;
  background: var(--desk); border-bottom: 1px solid var(--rule); }
.legend i { display: inline-block; width: .8em; height: .8em; border-radius: 50%;
  margin-right: .4em; }
.legend b { font-weight: 400; color: var(--muted); }
section { background: var(--paper); border: 1px solid var(--rule); border-radius: 12px;
  padding: 24px 28px; margin: 24px 0; scroll-margin-top: 64px; }
h2 { margin: 0; font-size: 1.4rem; }
section > p { color: var(--muted); margin: 4px 0 16px; max-width: 85ch; }
figure { margin: 0; cursor: zoom-in; }
figure:focus-visible { outline: 2px solid var(--accent); border-radius: 6px; }
/* Matplotlib asks for the nearest pixel, which at this size would drop every other column. */
figure image { image-rendering: auto !important; }
figure svg { display: block; width: 100%; height: auto; }
.tables { display: flex; flex-wrap: wrap; gap: 24px 56px; margin-top: 24px; align-items: start; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; flex: 1 1 320px; }
th, td { text-align: right; padding: 4px 0 4px 16px; border-bottom: 1px solid var(--rule); }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
th { font-weight: 600; } tfoot td { font-weight: 600; border-bottom: 0; }
code { color: var(--muted); font-size: .9em; }
footer { color: var(--muted); font-size: .9rem; padding-bottom: 40px; }
dialog { border: 0; padding: 0; margin: 0; width: 100vw; height: 100vh; max-width: none;
  max-height: none; overflow: hidden; background: var(--paper); color: var(--ink); }
dialog div { width: 100%; height: 100%; cursor: grab; touch-action: none;
  transform-origin: 0 0; }
dialog svg { width: 100%; height: 100%; }
/* Outlines and bones stay thin however far one goes in. */
dialog path { vector-effect: non-scaling-stroke; }
body:has(dialog[open]) { overflow: hidden; }
dialog button { position: fixed; top: 12px; right: 16px; font-size: 1.6rem; line-height: 1;
  width: 44px; height: 44px; border-radius: 50%; border: 1px solid var(--rule);
  background: var(--paper); color: var(--ink); cursor: pointer; }
@media print { .legend { position: static; } footer, nav { display: none; } }
"""

SCRIPT = """
const dialog = document.getElementById("zoom"), stage = dialog.firstElementChild;
let x = 0, y = 0, scale = 1;
const apply = () => { stage.style.transform = `translate(${x}px,${y}px) scale(${scale})`; };
let home = null;
const open = figure => {
  home = figure; figure.style.height = figure.offsetHeight + "px";
  stage.append(figure.firstElementChild);
  x = y = 0; scale = 1; apply(); dialog.showModal();
};
for (const figure of document.querySelectorAll("figure")) {
  figure.addEventListener("click", () => open(figure));
  figure.addEventListener("keydown", e => { if (e.key === "Enter") open(figure); });
}
dialog.addEventListener("close", () => {
  home.append(stage.firstElementChild); home.style.height = "";
});
dialog.querySelector("button").addEventListener("click", () => dialog.close());
dialog.addEventListener("wheel", e => {
  e.preventDefault();
  const next = Math.min(40, Math.max(1, scale * Math.exp(-e.deltaY / 400))), k = next / scale;
  x = e.clientX - k * (e.clientX - x); y = e.clientY - k * (e.clientY - y); scale = next;
  if (scale === 1) x = y = 0;
  apply();
}, { passive: false });
stage.addEventListener("pointerdown", e => stage.setPointerCapture(e.pointerId));
stage.addEventListener("pointermove", e => {
  if (!stage.hasPointerCapture(e.pointerId)) return;
  x += e.movementX; y += e.movementY; apply();
});
"""
