// SPDX-License-Identifier: MIT
// A face on a canvas: evaluated, moved and drawn, with a clip. The page and <risorius-face> add their own
// controls.
import { readClip } from "./clips.js";
import { unpack } from "./geometry.js";
import { Joints } from "./joints.js";
import { FaceError, Library, List } from "./library.js";
import { faceOf } from "./paint.js";
import { Player } from "./player.js";
import { Skin } from "./skin.js";
import { Stage } from "./stage.js";
import { Surfaces } from "./surfaces.js";

/** Errors in words for users. */
export function sentence(error) {
  // Without exceptions the library aborts when it runs out of memory.
  return error instanceof WebAssembly.RuntimeError
    ? `The face asks for more memory than the browser gives (${error.message}).`
    : `${error?.message ?? error}`;
}

export class Viewer {
  /** In: content (content.js), a canvas, and the root of a player's bar (#play, #time, #clock). */
  constructor(content, canvas, bar) {
    this.content = content;
    this.canvas = canvas;
    this.bar = bar;
    this.cost = { evaluated: 0, moved: 0, drawn: 0 };
    this.heard = () => {}; // called for each control that a clip moves
  }

  async open() {
    this.about = this.content.table;
    this.stage = new Stage(this.canvas);
    this.library = await Library.load(await this.content.bytes("library"));
    this.face = this.library.open(await this.content.bytes("face"));
    this.instance = this.face.instance();
    this.controls = this.face.names(List.RAW);
    this.raw = this.instance.values(List.RAW).slice();
    this.rest = this.raw.slice();
    this.joints = new Joints(this.face.skeleton());
    this.levels = Math.max(this.face.count(List.LODS), 1);
    this.makeRooms();
    this.makeSkins(unpack(this.about.meshes, await this.content.bytes("geometry")));
    const pictures = (await this.content.bytes("pictures")) ?? new Uint8Array(0);
    this.surfaces = new Surfaces(this.about, pictures);
    await this.setLod(0);
    this.stage.resize();
    this.stage.frame();
    this.makePlayer();
    await this.playOwn(this.about.clip);
    new ResizeObserver(() => this.stage.resize()).observe(this.canvas.parentElement);
    this.turn();
  }

  /** Matrices and channels that page.cpp reads, and the flags of changes since the last picture. */
  makeRooms() {
    const joints = this.joints.skeleton.count + 1;
    const channels = Math.max(this.face.count(List.SHAPES), 1);
    this.matrices = this.library.place(new Float32Array(16 * joints));
    this.channels = this.library.place(new Float32Array(channels));
    this.changes = { joints: new Uint8Array(joints), shapes: new Uint8Array(channels) };
  }

  /** Meshes of all LODs; only the meshes of the current LOD are moved. */
  makeSkins(meshes) {
    this.names = this.face.names(List.MESHES);
    this.parts = new Map();
    const mirrors = this.joints.scene.determinant() < 0;
    for (const [i, mesh] of meshes) {
      const skin = new Skin(this.library, mesh, this.joints.skeleton.count, mirrors);
      this.parts.set(i, { skin, name: this.names[i], objects: null });
    }
    if (this.parts.size === 0) throw new FaceError("This file has no meshes: there is nothing to show.");
  }

  async setLod(lod) {
    const known = this.face.count(List.LODS) > 0;
    if (known) this.instance.setLod(lod);
    const listed = known ? [...this.face.itemsOf(List.MESHES, lod)] : [];
    const shown = listed.filter((i) => this.parts.has(i));
    const parts = (shown.length > 0 ? shown : [...this.parts.keys()]).map((i) => this.parts.get(i));
    await this.dress(parts);
    this.shown = parts;
    this.stage.face.clear();
    this.stage.face.add(...parts.flatMap((part) => part.objects));
    this.stage.wrinkles = this.surfaces.wrinkles;
    this.vertices = parts.reduce((sum, part) => sum + part.skin.count, 0);
    this.pose(true);
  }
  /** Materials are made from the face at rest, when its LOD is first shown. */
  async dress(parts) {
    const bare = parts.filter((part) => part.objects === null);
    if (bare.length === 0) return;
    const now = this.raw.slice();
    this.raw.set(this.rest);
    this.joints.turn([]);
    this.shown = parts;
    this.pose(true);
    const face = faceOf(parts);
    for (const part of bare) {
      const { material } = part.skin.mesh;
      part.objects = await this.surfaces.objects(material, part.name, part.skin, face);
    }
    this.raw.set(now);
    this.player?.seek(this.player.time);
  }

  /** In: whether to move all meshes, changed or not. */
  pose(all = false) {
    const begin = performance.now();
    this.instance.setRaw(this.raw);
    this.instance.evaluate();
    const evaluated = performance.now();
    const { library, changes } = this;
    const matrices = library.numbers(Float32Array, this.matrices, 16 * changes.joints.length);
    this.joints.pose(this.instance.values(List.JOINTS), matrices, changes.joints);
    const weights = this.instance.values(List.SHAPES);
    const channels = library.numbers(Float32Array, this.channels, changes.shapes.length);
    for (let i = 0; i < weights.length; ++i) changes.shapes[i] = channels[i] === weights[i] ? 0 : 1;
    channels.set(weights);
    for (const part of this.shown) part.skin.pose(this.matrices, this.channels, all ? null : changes);
    const maps = this.instance.values(List.MAPS);
    for (const wrinkles of this.stage.wrinkles) wrinkles.pose(maps);
    this.cost.evaluated = evaluated - begin;
    this.cost.moved = performance.now() - evaluated;
    this.changed = false;
    this.stage.dirty = this.stage.moved = true;
  }

  /** In: values by raw control name, with or without the part before its dot. */
  set(values) {
    for (const [name, value] of Object.entries(values)) {
      const index = this.controls.findIndex((own) => own === name || own.split(".").pop() === name);
      if (index < 0) throw new FaceError(`${name}: this face has no raw control of this name`);
      this.raw[index] = value;
      this.heard(index, value);
    }
    this.changed = true;
  }
  reset() {
    this.player.pause();
    this.raw.set(this.rest);
    this.joints.turn([]);
    this.raw.forEach((value, i) => this.heard(i, value));
    this.changed = true;
  }

  makePlayer() {
    this.player = new Player(this.bar, (pairs, turns) => {
      for (const [control, value] of pairs) {
        this.raw[control] = value;
        this.heard(control, value);
      }
      this.joints.turn(turns);
      this.changed = true;
    });
  }
  async playOwn(clip) {
    if (!clip) return;
    const packed = await this.content.bytes("clip");
    const values = new Float32Array(packed.buffer, packed.byteOffset, packed.byteLength / 4);
    this.player.load(clip, values, clip.sound);
  }

  /** Plays files of the user: a take as .csv or .rzc, a sound. In: a list of File. */
  async play(files) {
    const sounds = [...files].filter((file) => /\.(wav|mp3|ogg|m4a)$/i.test(file.name));
    for (const file of files) {
      if (sounds.includes(file)) continue;
      const { clip, values } = await readClip(file, this);
      this.reset();
      this.player.load(clip, values, null);
    }
    for (const file of sounds) await this.hear(file);
    this.player.play();
  }
  /** A sound plays with a clip that has none; alone it opens the mouth by its loudness. */
  async hear(file) {
    const sound = { url: URL.createObjectURL(file), offset: 0 };
    if (this.player.clip && !this.player.audio) return this.player.listen(sound);
    const { clip, values } = await readClip(file, this);
    this.reset();
    this.player.load(clip, values, sound);
  }

  turn() {
    if (this.turning) return;
    this.turning = true;
    const again = () => {
      this.turning = this.canvas.isConnected; // the element may be removed from its page
      if (!this.turning) return;
      requestAnimationFrame(again);
      this.player.step();
      if (this.changed) this.pose();
      const begin = performance.now();
      if (this.stage.draw()) this.cost.drawn = performance.now() - begin;
      this.drawn?.();
    };
    again();
  }

  /** For tests: a pose as numbers, as in Python. */
  evaluate(raw, lod) {
    this.instance.setLod(lod);
    this.instance.setRaw(raw);
    this.instance.evaluate();
    const values = (list) => Array.from(this.instance.values(list));
    return { joints: values(List.JOINTS), shapes: values(List.SHAPES), maps: values(List.MAPS) };
  }
}
