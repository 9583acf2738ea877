// SPDX-License-Identifier: MIT
// The page: a face, its sliders, its levels of detail, a clip.
import { bytes, table } from "./content.js";
import { Joints, toScene } from "./joints.js";
import { FaceError, Library, List } from "./library.js";
import { Panel } from "./panel.js";
import { Player } from "./player.js";
import { Stage, materialOf, meshOf } from "./scene.js";
import { Skin } from "./skin.js";

const $ = (id) => document.getElementById(id);

function complain(error) {
  // Without exceptions the library ends where it has no memory.
  const text =
    error instanceof WebAssembly.RuntimeError
      ? `The face asks for more memory than the browser gives (${error.message}).`
      : `${error?.message ?? error}`;
  $("error").hidden = false;
  $("error-text").textContent = text;
  $("wait").hidden = true;
  document.body.dataset.state = "error";
}
addEventListener("error", (event) => complain(event.error ?? event.message));
addEventListener("unhandledrejection", (event) => complain(event.reason));

class Viewer {
  async open() {
    const about = table();
    document.title = about.title;
    $("title").textContent = about.title;
    this.stage = new Stage($("canvas"));
    this.library = await Library.load(await bytes("library"));
    this.face = this.library.open(await bytes("face"));
    this.instance = this.face.instance();
    this.raw = this.instance.values(List.RAW).slice();
    this.rest = this.raw.slice();
    this.joints = new Joints(this.face.skeleton());
    this.scene = toScene(this.joints.skeleton);
    await this.makeMeshes(about.pictures);
    this.panel = new Panel($("panel"), about.regions, this.face.names(List.RAW), (i, value) => {
      this.raw[i] = value;
      this.changed = true;
    });
    this.chooseLods();
    this.setLod(0);
    this.stage.resize();
    this.stage.frame();
    await this.makePlayer(about.clip);
    this.wire();
  }

  /** Meshes of all levels: only those of the one that is shown are moved. */
  async makeMeshes(pictures) {
    const names = this.face.names(List.MESHES);
    this.parts = new Map();
    const materials = new Map();
    for (let i = 0; i < names.length; ++i) {
      const mesh = this.face.mesh(i);
      if (mesh.vertices === 0) continue;
      const own = pictures[names[i]] ?? {};
      const key = JSON.stringify([names[i].replace(/_lod\d+.*/i, ""), own]);
      if (!materials.has(key)) materials.set(key, await materialOf(names[i], own));
      const skin = new Skin(mesh, this.scene);
      this.parts.set(i, { skin, object: meshOf(skin, materials.get(key)) });
    }
    if (this.parts.size === 0) throw new FaceError("This file has no meshes: there is nothing to show.");
  }

  chooseLods() {
    const count = Math.max(this.face.count(List.LODS), 1);
    for (let lod = 0; lod < count; ++lod) $("lod").add(new Option(`LOD ${lod}`, lod));
    $("lod").disabled = count < 2;
    $("lod").addEventListener("change", () => this.setLod(Number($("lod").value)));
  }
  setLod(lod) {
    if (this.face.count(List.LODS) > 0) this.instance.setLod(lod);
    const listed = this.face.count(List.LODS) > 0 ? [...this.face.itemsOf(List.MESHES, lod)] : [];
    const shown = listed.filter((i) => this.parts.has(i));
    this.shown = (shown.length > 0 ? shown : [...this.parts.keys()]).map((i) => this.parts.get(i));
    this.stage.face.clear();
    this.stage.face.add(...this.shown.map((part) => part.object));
    this.vertices = this.shown.reduce((sum, part) => sum + part.skin.mesh.vertices, 0);
    this.pose();
  }

  pose() {
    const begin = performance.now();
    this.instance.setRaw(this.raw);
    this.instance.evaluate();
    this.cost = performance.now() - begin;
    const skin = this.joints.pose(this.instance.values(List.JOINTS));
    const weights = this.instance.values(List.SHAPES).slice();
    for (const part of this.shown) part.skin.pose(skin, weights);
    this.changed = false;
    this.stage.dirty = true;
    this.read();
  }
  read() {
    const now = performance.now();
    if (now - (this.wasRead ?? 0) < 250) return;
    this.wasRead = now;
    $("facts").textContent =
      `${this.vertices.toLocaleString("en")} vertices · evaluated in ${this.cost.toFixed(2)} ms`;
  }

  async makePlayer(clip) {
    if (!clip) return;
    const packed = await bytes("clip");
    const values = new Float32Array(packed.buffer, packed.byteOffset, packed.byteLength / 4);
    this.player = new Player($("player"), clip, values, clip.sound, (pairs, turns) => {
      for (const [control, value] of pairs) {
        this.raw[control] = value;
        this.panel.show(control, value);
      }
      this.joints.turn(turns);
      this.changed = true;
    });
  }

  wire() {
    $("reset").addEventListener("click", () => {
      this.player?.pause();
      this.raw.set(this.rest);
      this.joints.turn([]);
      this.raw.forEach((value, i) => this.panel.show(i, value));
      this.changed = true;
    });
    $("home").addEventListener("click", () => this.stage.home());
    $("dismiss").addEventListener("click", () => ($("error").hidden = true));
    new ResizeObserver(() => this.stage.resize()).observe($("canvas").parentElement);
    const turn = () => {
      requestAnimationFrame(turn);
      this.player?.step();
      if (this.changed) this.pose();
      this.stage.draw();
    };
    turn();
  }

  /** For tests: a pose by numbers, as Python has it. */
  evaluate(raw, lod) {
    this.instance.setLod(lod);
    this.instance.setRaw(raw);
    this.instance.evaluate();
    const values = (list) => Array.from(this.instance.values(list));
    return { joints: values(List.JOINTS), shapes: values(List.SHAPES), maps: values(List.MAPS) };
  }
}

const viewer = new Viewer();
globalThis.risorius = viewer;
viewer.open().then(() => {
  $("wait").hidden = true;
  document.body.dataset.state = "ready";
}, complain);
