// SPDX-License-Identifier: MIT
// <risorius-face>: a face of `risorius web FACE.dna -o face.js` on the user's own page.
import { inScript } from "./content.js";
import { FaceError } from "./library.js";
import { Viewer, sentence } from "./viewer.js";

const INSIDE = `<style>
:host { display: block; position: relative; width: 360px; height: 440px; background: #2a3037; overflow: hidden;
  color: #eceef1; font: 14px system-ui, sans-serif; }
div { position: absolute; inset: 0; }
canvas { width: 100%; height: 100%; display: block; touch-action: none; }
#player { inset: auto 0 0; display: flex; gap: 10px; align-items: center; padding: 8px 12px; background: #1b2026b0; }
#player[hidden] { display: none; }
button { min-width: 44px; min-height: 36px; font: inherit; color: inherit; background: #262d35; border: 0; border-radius: 8px; }
input { flex: 1; min-width: 0; }
p { position: absolute; inset: 40% 0 auto; margin: 0; padding: 0 16px; text-align: center; pointer-events: none; }
</style><div><canvas></canvas></div><p>Opening the face…</p>
<div id="player" hidden><button id="play" aria-label="Play">▶</button>
<input type="range" id="time" min="0" value="0" aria-label="Time"><output id="clock"></output></div>`;

class RisoriusFace extends HTMLElement {
  connectedCallback() {
    if (this.shadowRoot) return void this.viewer?.turn(); // the element was put back on its page
    const root = this.attachShadow({ mode: "open" });
    root.innerHTML = INSIDE;
    this.addEventListener("dragover", (event) => event.preventDefault());
    this.addEventListener("drop", (event) => {
      event.preventDefault();
      this.playFiles(event.dataTransfer.files).catch((error) => this.say(error));
    });
    /** Resolves when the face is shown. */
    this.ready = this.open();
    this.ready.catch((error) => this.say(error));
  }
  async open() {
    const faces = globalThis.risoriusFaces ?? {};
    const name = this.getAttribute("name") ?? Object.keys(faces)[0];
    if (!(name in faces)) throw new FaceError(`one of the faces ${Object.keys(faces).join(", ")} was expected, found ${name}`);
    const root = this.shadowRoot;
    this.viewer = new Viewer(inScript(faces[name]), root.querySelector("canvas"), root.querySelector("#player"));
    await this.viewer.open();
    root.querySelector("p").textContent = "";
    this.dispatchEvent(new Event("ready"));
    return this;
  }
  say(error) {
    this.shadowRoot.querySelector("p").textContent = sentence(error);
    this.dispatchEvent(new CustomEvent("error", { detail: error }));
  }
  /** Values by the name of a raw control: { jawOpen: 0.4 }. */
  set(values) {
    this.viewer.set(values);
  }
  play() {
    this.viewer.player.play();
  }
  pause() {
    this.viewer.player.pause();
  }
  /** In: a list of File: a take and its sound. */
  playFiles(files) {
    return this.viewer.play(files);
  }
}

export function define() {
  if (!customElements.get("risorius-face")) customElements.define("risorius-face", RisoriusFace);
}
