// SPDX-License-Identifier: MIT
// A moving mesh: shapes, then joints, then normals, by page.cpp in the library's memory. Influences
// and shapes are unlimited.
import { BufferAttribute, BufferGeometry, InterleavedBuffer, InterleavedBufferAttribute } from "three";

export class Skin {
  /** In: the library; a mesh of geometry.js; number of joints; whether the scene's axes mirror. */
  constructor(library, mesh, joints, mirrors) {
    this.library = library;
    this.mesh = mesh;
    this.count = mesh.positions.length / 4;
    if (mesh.influences.length < 2) this.hang(joints);
    this.corners = mesh.index.map((v) => mesh.source[v]);
    if (this.turnsInside(mirrors)) {
      for (const list of [mesh.index, this.corners]) {
        for (let i = 0; i < list.length; i += 3) [list[i], list[i + 1]] = [list[i + 1], list[i]];
      }
    }
    if (mesh.normals && mesh.kind !== "skin") this.innerFirst();
    this.joints = [...new Set(mesh.joints)];
    this.shapes = [...new Set(mesh.channels)];
    this.place();
    this.geometry = new BufferGeometry();
    this.geometry.setIndex(new BufferAttribute(mesh.index, 1));
    this.geometry.setAttribute("uv", new BufferAttribute(mesh.uvs, 2));
    this.out = new InterleavedBuffer(this.view(), 6);
    this.geometry.setAttribute("position", new InterleavedBufferAttribute(this.out, 3, 0));
    this.geometry.setAttribute("normal", new InterleavedBufferAttribute(this.out, 3, 3));
  }

  /** A mesh without weights uses the last matrix, behind the matrices of the joints. */
  hang(joints) {
    const { mesh } = this;
    mesh.influences = Uint32Array.from({ length: this.count + 1 }, (_, i) => i);
    mesh.joints = new Uint32Array(this.count).fill(joints);
    mesh.weights = new Float32Array(this.count).fill(1);
  }

  /** Whether to reverse the polygons: files use both windings, and axes may mirror. */
  turnsInside(mirrors) {
    const { positions: p } = this.mesh;
    const middle = [0, 1, 2].map((k) => {
      let sum = 0;
      for (let i = k; i < p.length; i += 4) sum += p[i];
      return sum / this.count;
    });
    const at = (v, k) => p[4 * v + k] - middle[k];
    let volume = 0;
    for (let i = 0; i < this.corners.length; i += 3) {
      const [a, b, c] = this.corners.subarray(i, i + 3);
      volume += at(a, 0) * (at(b, 1) * at(c, 2) - at(b, 2) * at(c, 1));
      volume += at(a, 1) * (at(b, 2) * at(c, 0) - at(b, 0) * at(c, 2));
      volume += at(a, 2) * (at(b, 0) * at(c, 1) - at(b, 1) * at(c, 0));
    }
    return mirrors ? volume > 0 : volume < 0;
  }

  /** Cards lie around a head. Drawn from the innermost to the outermost, they cover each other as hair does from
   * every side, and need no sorting per picture. */
  innerFirst() {
    const { positions: p, index } = this.mesh;
    const sum = [0, 0, 0];
    for (let i = 0; i < p.length; ++i) if (i % 4 < 3) sum[i % 4] += p[i] / this.count;
    const far = (t) => {
      let squares = 0;
      for (let k = 0; k < 3; ++k) {
        const mean = (p[4 * this.corners[t] + k] + p[4 * this.corners[t + 1] + k] + p[4 * this.corners[t + 2] + k]) / 3;
        squares += (mean - sum[k]) ** 2;
      }
      return squares;
    };
    const order = Array.from({ length: index.length / 3 }, (_, i) => [far(3 * i), 3 * i]);
    order.sort((a, b) => a[0] - b[0]);
    const sorted = (list) => Uint32Array.from(order.flatMap(([, at]) => [list[at], list[at + 1], list[at + 2]]));
    [this.mesh.index, this.corners] = [sorted(index), sorted(this.corners)];
  }

  /** Writes PageMesh, the input of page.cpp, into the library's memory. */
  place() {
    const { library, mesh, count } = this;
    const vertices = mesh.source.length;
    const room = () => library.place(new Float32Array(4 * count));
    this.at = library.place(Uint32Array.from([
      count, vertices, this.corners.length / 3, mesh.channels.length,
      library.place(mesh.positions), library.place(mesh.source), library.place(this.corners),
      library.place(mesh.influences), library.place(mesh.joints), library.place(mesh.weights),
      library.place(mesh.moved), library.place(mesh.channels), library.place(mesh.moves),
      library.place(mesh.deltas), mesh.normals ? library.place(mesh.normals) : 0,
      room(), (this.placed = room()), room(), (this.shown = library.place(new Float32Array(6 * vertices))),
    ]));
  }
  view() {
    return this.library.numbers(Float32Array, this.shown, 6 * this.mesh.source.length);
  }

  /** In: addresses of matrices (16 floats per joint) and channels in the library's memory; flags of matrices
   * and channels that changed since the last call, or null for all. */
  pose(matrices, channels, changed) {
    const moves =
      changed === null ||
      this.joints.some((joint) => changed.joints[joint]) ||
      this.shapes.some((shape) => changed.shapes[shape]);
    if (!moves) return false;
    this.library.c.page_pose(this.at, matrices, channels);
    this.out.array = this.view(); // the memory may have moved when it grew
    this.out.needsUpdate = true;
    return true;
  }
}
