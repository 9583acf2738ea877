// SPDX-License-Identifier: MIT
// Decodes the lists that native/python/risorius/web/geometry.py wrote.

class Streams {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  /** The next list. In: length, bytes per number, distance between a difference and its base (0: no differences). */
  next([count, width, stride]) {
    const out = new Int32Array(count);
    const { bytes, at } = this;
    for (let plane = 0; plane < width; ++plane) {
      const from = at + plane * count;
      const shift = 8 * plane;
      for (let i = 0; i < count; ++i) out[i] |= bytes[from + i] << shift;
    }
    for (let i = 0; i < count; ++i) out[i] = (out[i] >>> 1) ^ -(out[i] & 1);
    if (stride > 0) for (let i = stride; i < count; ++i) out[i] += out[i - stride];
    this.at += count * width;
    return out;
  }
  /** A list of steps, per axis. */
  scaled([step, ...how]) {
    return Float32Array.from(this.next(how), (whole) => whole * step);
  }
}

/** Sums of all numbers before each number, and the sum of all. */
function begins(counts) {
  const out = new Uint32Array(counts.length + 1);
  for (let i = 0; i < counts.length; ++i) out[i + 1] = out[i] + counts[i];
  return out;
}

/** Three numbers per place, padded to four. */
function fours(byAxis, factor, last = 0) {
  const count = byAxis.length / 3;
  const out = new Float32Array(4 * count);
  for (let i = 0; i < count; ++i) {
    for (let k = 0; k < 3; ++k) out[4 * i + k] = byAxis[k * count + i] * factor;
    out[4 * i + 3] = last;
  }
  return out;
}

function triangles(sides, corners) {
  const out = [];
  let begin = 0;
  for (const count of sides) {
    for (let i = 2; i < count; ++i) out.push(corners[begin], corners[begin + i - 1], corners[begin + i]);
    begin += count;
  }
  return Uint32Array.from(out);
}

function mesh(about, streams) {
  const positions = fours(streams.scaled(about.positions), 1);
  const uv = streams.scaled(about.uv);
  const source = Uint32Array.from(streams.next(about.source));
  const count = source.length;
  const uvs = new Float32Array(2 * count);
  for (let i = 0; i < uv.length / 2; ++i) uvs.set([uv[i], uv[count + i]], 2 * i);
  const sides = streams.next(about.sides);
  const index = triangles(sides, streams.next(about.corners));
  const influences = begins(streams.next(about.influences));
  const joints = Uint32Array.from(streams.next(about.joints));
  const weights = Float32Array.from(streams.next(about.weights));
  for (let v = 0; v + 1 < influences.length; ++v) {
    const own = weights.subarray(influences[v], influences[v + 1]);
    const sum = own.reduce((a, b) => a + b, 0) || 1;
    for (let i = 0; i < own.length; ++i) own[i] /= sum;
  }
  const normals = about.normals
    ? fours(byAxisOf(streams.next(about.normals)), 1 / 127)
    : null;
  const out = { positions, uvs, source, index, influences, joints, weights, normals };
  out.channels = Uint32Array.from(about.shapes);
  if (about.shapes.length === 0) return { ...out, moved: new Uint32Array(1), moves: new Uint32Array(0), deltas: new Float32Array(0) };
  out.moved = begins(streams.next(about.moved));
  const steps = streams.next(about.vertices);
  out.moves = new Uint32Array(steps.length);
  for (let t = 0; t < about.shapes.length; ++t) {
    let vertex = 0;
    for (let i = out.moved[t]; i < out.moved[t + 1]; ++i) out.moves[i] = vertex += steps[i];
  }
  out.deltas = fours(streams.scaled(about.deltas), 1);
  return out;
}

/** Turns [a, b, c, a, b, c, ...] into all a, all b, all c. */
function byAxisOf(list) {
  const count = list.length / 3;
  return Float32Array.from(list, (_, i) => list[3 * (i % count) + Math.floor(i / count)]);
}

/** In: meshes of the table, bytes of "geometry". Out: meshes by their number in the file. */
export function unpack(abouts, bytes) {
  const streams = new Streams(bytes);
  return new Map(abouts.map((about) => [about.index, { ...mesh(about, streams), kind: about.kind, material: about.material }]));
}
