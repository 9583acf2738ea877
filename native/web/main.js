// SPDX-License-Identifier: MIT
// The page: a face, its sliders, its LODs and a clip. Also <risorius-face> for other pages
// (element.js).
import { inPage } from "./content.js";
import { define } from "./element.js";
import { Panel } from "./panel.js";
import { Viewer, sentence } from "./viewer.js";

const $ = (id) => document.getElementById(id);

function complain(error) {
  $("error").hidden = false;
  $("error-text").textContent = sentence(error);
  $("wait").hidden = true;
}

class Page extends Viewer {
  constructor() {
    super(inPage, $("canvas"), $("player"));
  }
  async open() {
    const { title, regions } = inPage.table;
    document.title = title;
    $("title").textContent = title;
    await super.open();
    this.panel = new Panel($("panel"), regions, this.controls, (i, value) => {
      this.raw[i] = value;
      this.changed = true;
    });
    this.heard = (i, value) => this.panel.show(i, value);
    this.raw.forEach((value, i) => this.panel.show(i, value));
    this.chooseLods();
    this.wire();
  }
  chooseLods() {
    for (let lod = 0; lod < this.levels; ++lod) $("lod").add(new Option(`LOD ${lod}`, lod));
    $("lod").disabled = this.levels < 2;
    $("lod").addEventListener("change", () => this.setLod(Number($("lod").value)).catch(complain));
  }
  wire() {
    $("reset").addEventListener("click", () => this.reset());
    $("home").addEventListener("click", () => this.stage.home());
    $("dismiss").addEventListener("click", () => ($("error").hidden = true));
    addEventListener("keydown", (event) => {
      if (event.code !== "Space" || event.target.closest("input[type=search], button, select")) return;
      event.preventDefault();
      if (this.player.clip) this.player.button.click();
    });
    const take = (files) => this.play(files).catch(complain);
    $("open").addEventListener("click", () => $("file").click());
    $("file").addEventListener("change", () => take($("file").files));
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      take(event.dataTransfer.files);
    });
  }
  drawn() {
    const now = performance.now();
    if (now - (this.wasRead ?? 0) < 250) return;
    this.wasRead = now;
    const { evaluated, moved, drawn } = this.cost;
    $("facts").textContent = `${this.vertices.toLocaleString("en")} vertices · evaluated in ${evaluated.toFixed(1)} ms, ` +
      `moved in ${moved.toFixed(1)} ms, drawn in ${drawn.toFixed(1)} ms`;
  }
}

define();
if ($("face-table") !== null) {
  const fail = (error) => {
    complain(error);
    if (document.body.dataset.state === "loading") document.body.dataset.state = "error";
  };
  addEventListener("error", (event) => fail(event.error ?? event.message));
  addEventListener("unhandledrejection", (event) => fail(event.reason));
  const page = new Page();
  globalThis.risorius = page;
  page.open().then(() => {
    $("wait").hidden = true;
    document.body.dataset.state = "ready";
  }, fail);
}
