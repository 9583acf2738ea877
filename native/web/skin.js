// SPDX-License-Identifier: MIT
// A mesh that moves: shapes, then joints, then normals. Any number of influences and shapes.
import { BufferAttribute, BufferGeometry } from "three";

/** Corners that agree in position and texture coordinate are one vertex of the graphics card. */
function weld(mesh) {
  const places = new Map();
  const source = [];
  const uv = [];
  const index = [];
  const vertexOf = (corner) => {
    const [p, t] = [mesh.cornerPositions[corner], mesh.cornerUvs[corner] ?? 0];
    const key = p * (mesh.uvCount + 1) + t;
    let found = places.get(key);
    if (found === undefined) {
      found = source.length;
      places.set(key, found);
      source.push(p);
      uv.push(mesh.uvs[t] ?? 0, mesh.uvs[mesh.uvCount + t] ?? 0);
    }
    return found;
  };
  for (let f = 0; f + 1 < mesh.begins.length; ++f) {
    const corners = mesh.polygonCorners.subarray(mesh.begins[f], mesh.begins[f + 1]);
    for (let i = 2; i < corners.length; ++i) {
      index.push(vertexOf(corners[0]), vertexOf(corners[i - 1]), vertexOf(corners[i]));
    }
  }
  return { source: Uint32Array.from(source), uv: Float32Array.from(uv), index: Uint32Array.from(index) };
}

export class Skin {
  constructor(mesh, toScene) {
    this.mesh = mesh;
    this.scene = toScene.elements;
    const { source, uv, index } = weld(mesh);
    this.source = source;
    this.index = index;
    this.corners = index.map((v) => source[v]);
    if (this.turnsInside(toScene)) {
      for (const list of [index, this.corners]) {
        for (let i = 0; i < list.length; i += 3) [list[i], list[i + 1]] = [list[i + 1], list[i]];
      }
    }
    this.shaped = new Float32Array(mesh.positions.length);
    this.placed = new Float32Array(3 * mesh.vertices);
    this.normals = new Float32Array(3 * mesh.vertices);
    this.geometry = new BufferGeometry();
    this.geometry.setIndex(new BufferAttribute(index, 1));
    this.geometry.setAttribute("uv", new BufferAttribute(uv, 2));
    this.position = new BufferAttribute(new Float32Array(3 * source.length), 3);
    this.normal = new BufferAttribute(new Float32Array(3 * source.length), 3);
    this.geometry.setAttribute("position", this.position);
    this.geometry.setAttribute("normal", this.normal);
  }

  /** Whether the polygons show their backs: files wind them both ways, and axes may mirror. */
  turnsInside(toScene) {
    const { positions: p, vertices: n } = this.mesh;
    const middle = [0, 1, 2].map((k) => p.subarray(k * n, (k + 1) * n).reduce((a, b) => a + b, 0) / n);
    const at = (v, k) => p[k * n + v] - middle[k];
    let volume = 0;
    for (let i = 0; i < this.corners.length; i += 3) {
      const [a, b, c] = this.corners.subarray(i, i + 3);
      volume += at(a, 0) * (at(b, 1) * at(c, 2) - at(b, 2) * at(c, 1));
      volume += at(a, 1) * (at(b, 2) * at(c, 0) - at(b, 0) * at(c, 2));
      volume += at(a, 2) * (at(b, 0) * at(c, 1) - at(b, 1) * at(c, 0));
    }
    return volume * toScene.determinant() < 0;
  }

  /** In: skin of Joints.pose, weights float32[channels]. */
  pose(skin, weights) {
    this.addShapes(weights);
    this.addJoints(skin);
    this.turnNormals();
    for (let v = 0; v < this.source.length; ++v) {
      const from = 3 * this.source[v];
      for (let k = 0; k < 3; ++k) {
        this.position.array[3 * v + k] = this.placed[from + k];
        this.normal.array[3 * v + k] = this.normals[from + k];
      }
    }
    this.position.needsUpdate = true;
    this.normal.needsUpdate = true;
  }

  addShapes(weights) {
    const { positions, targets, vertices: count } = this.mesh;
    this.shaped.set(positions);
    for (const { shape, vertices, deltas } of targets) {
      const weight = weights[shape];
      if (weight === 0) continue;
      const n = vertices.length;
      for (let i = 0; i < n; ++i) {
        const v = vertices[i];
        this.shaped[v] += weight * deltas[i];
        this.shaped[count + v] += weight * deltas[n + i];
        this.shaped[2 * count + v] += weight * deltas[2 * n + i];
      }
    }
  }

  addJoints(matrices) {
    const { skin, weights, joints, vertices: count } = this.mesh;
    const { shaped, placed, scene: s } = this;
    for (let v = 0; v < count; ++v) {
      const [x, y, z] = [shaped[v], shaped[count + v], shaped[2 * count + v]];
      let [a, b, c] = skin.length ? [0, 0, 0] : [x, y, z];
      for (let i = skin[v]; i < skin[v + 1]; ++i) {
        const m = 12 * joints[i];
        const w = weights[i];
        a += w * (matrices[m] * x + matrices[m + 1] * y + matrices[m + 2] * z + matrices[m + 3]);
        b += w * (matrices[m + 4] * x + matrices[m + 5] * y + matrices[m + 6] * z + matrices[m + 7]);
        c += w * (matrices[m + 8] * x + matrices[m + 9] * y + matrices[m + 10] * z + matrices[m + 11]);
      }
      placed[3 * v] = s[0] * a + s[4] * b + s[8] * c;
      placed[3 * v + 1] = s[1] * a + s[5] * b + s[9] * c;
      placed[3 * v + 2] = s[2] * a + s[6] * b + s[10] * c;
    }
  }

  turnNormals() {
    const { placed: p, normals: n, corners } = this;
    n.fill(0);
    for (let i = 0; i < corners.length; i += 3) {
      const [a, b, c] = [3 * corners[i], 3 * corners[i + 1], 3 * corners[i + 2]];
      const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
      const [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
      const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      for (const at of [a, b, c]) {
        n[at] += x;
        n[at + 1] += y;
        n[at + 2] += z;
      }
    }
    for (let i = 0; i < n.length; i += 3) {
      const length = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
      n[i] /= length;
      n[i + 1] /= length;
      n[i + 2] /= length;
    }
  }
}
