// SPDX-License-Identifier: MIT
// Colours of surfaces without textures, per vertex, with the same numbers as Blender's nodes
// (addon/risorius/scene/material). All colours are linear.
import { BufferAttribute } from "three";

const ENAMEL = [[0.35, [0.74, 0.66, 0.53]], [1.0, [0.62, 0.47, 0.29]]];
const GUM = [[0.3, [0.28, 0.065, 0.06]], [0.7, [0.44, 0.14, 0.12]]];
const TONGUE = [[0.3, [0.3, 0.065, 0.065]], [0.7, [0.45, 0.15, 0.14]]];
const CARUNCLE = [[0.3, [0.44, 0.15, 0.13]], [0.7, [0.58, 0.27, 0.23]]];
const SKIN = [[0.32, [0.5, 0.26, 0.18]], [0.68, [0.6, 0.35, 0.25]]];
// Lips and cheeks shade the back of the mouth.
const SHADED = [[0.12, [1, 1, 1]], [0.24, [0.77, 0.75, 0.73]], [0.35, [0.46, 0.42, 0.39]], [0.62, [0.18, 0.13, 0.11]]];
const LIPS = [0.42, 0.13, 0.11];
const INSIDE = [0.16, 0.04, 0.035];

/** In: stops [[at, [r, g, b]], ...] in rising order. */
function ramp(stops, at) {
  const next = stops.findIndex(([place]) => place >= at);
  if (next === -1) return stops[stops.length - 1][1];
  if (next === 0) return stops[0][1];
  const [[a, one], [b, other]] = [stops[next - 1], stops[next]];
  const share = (at - a) / (b - a);
  return one.map((value, i) => value + share * (other[i] - value));
}

const chance = (x, y, z) => {
  const wave = Math.sin(x * 127.1 + y * 311.7 + z * 74.7) * 43758.5453;
  return wave - Math.floor(wave);
};
/** Noise from 0 to 1, with a mean near 0.5. */
function noise(p, scale, octaves = 2) {
  let sum = 0;
  let all = 0;
  for (let octave = 0, share = 1; octave < octaves; ++octave, share /= 2) {
    const at = p.map((value) => value * scale * 2 ** octave);
    const [x, y, z] = at.map(Math.floor);
    const [u, v, w] = at.map((value) => value - Math.floor(value)).map((t) => t * t * (3 - 2 * t));
    let mean = 0;
    for (let i = 0; i < 8; ++i) {
      const [a, b, c] = [i & 1, (i >> 1) & 1, i >> 2];
      mean += chance(x + a, y + b, z + c) * (a ? u : 1 - u) * (b ? v : 1 - v) * (c ? w : 1 - w);
    }
    sum += share * mean;
    all += share;
  }
  return sum / all;
}

const boxOf = (points) => {
  const box = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
  for (const p of points) {
    for (let k = 0; k < 3; ++k) {
      box.min[k] = Math.min(box.min[k], p[k]);
      box.max[k] = Math.max(box.max[k], p[k]);
    }
  }
  return box;
};
const middleOf = ({ min, max }) => min.map((low, k) => (low + max[k]) / 2);

/** Places of a mesh at rest in the scene: metres, x to the viewer's right, y up, z to the front. */
export function places({ out, mesh }) {
  return Array.from(mesh.source, (_, v) => [...out.array.subarray(6 * v, 6 * v + 3)]);
}

/** Left and right balls of a mesh; one mesh may hold both. */
function balls(points) {
  const box = boxOf(points);
  const wide = box.max[0] - box.min[0] > 1.6 * (box.max[1] - box.min[1]);
  const middle = middleOf(box)[0];
  return points.map((p) => (wide && p[0] > middle ? 1 : 0));
}

/** The unit of all patterns: the distance between the eyes. In: parts of one LOD. */
export function faceOf(parts) {
  const eyes = parts.filter(({ skin }) => skin.mesh.kind === "eyes");
  const middles = eyes.flatMap(({ skin }) => {
    const points = places(skin);
    const sides = balls(points);
    return [0, 1].map((side) => points.filter((_, v) => sides[v] === side)).filter((own) => own.length)
      .map((own) => middleOf(boxOf(own)));
  });
  const across = middles.map((middle) => middle[0]);
  const teeth = parts.find(({ skin }) => skin.mesh.kind === "teeth");
  const mouth = teeth ? boxOf(places(teeth.skin)) : null;
  const unit = across.length > 1 ? Math.max(...across) - Math.min(...across) : 0;
  return { unit: unit || 0.063, mouth };
}

const FLESH = { gum: GUM, tongue: TONGUE };

function toothOf(points, unit) {
  const { min, max } = boxOf(points);
  const half = Math.max((max[1] - min[1]) / 2, 1e-9);
  return (p) => {
    const height = Math.abs(p[1] - (min[1] + max[1]) / 2) / half;
    return ramp(ENAMEL, 0.5 * noise(p, 16 / unit) + height);
  };
}

function skinOf(unit, mouth) {
  return (p) => {
    const tone = ramp(SKIN, noise(p, 1.1 / unit, 4));
    if (mouth === null) return tone;
    const [x, y] = [0, 1].map((k) => (p[k] - (mouth.min[k] + mouth.max[k]) / 2) / unit);
    const wide = (mouth.max[0] - mouth.min[0]) / 2 / unit;
    const deep = (mouth.max[2] - mouth.min[2]) / unit;
    const back = (p[2] - mouth.max[2]) / unit;
    const arch = -0.04 - deep * (x / wide) ** 2; // teeth form an arch: everything behind it is in the mouth
    if (Math.abs(y) < 0.5 && back < arch && back > -deep - 0.3) return INSIDE;
    const front = back > -0.12;
    const near = front ? Math.exp(-((x / 0.4) ** 4) - ((y / 0.19) ** 4)) : 0;
    return tone.map((value, i) => value + 0.85 * near * (LIPS[i] - value));
  };
}

/** Vertex colours of a mesh without a texture; null if its material has one colour.
 * In: skin at rest, name of its mesh, faceOf. */
export function colorsOf(skin, name, { unit, mouth }) {
  const { kind } = skin.mesh;
  const points = places(skin);
  const front = points.reduce((most, p) => Math.max(most, p[2]), -Infinity);
  const deep = (p) => ramp(SHADED, (front - p[2]) / unit);
  let paint = null;
  if (kind === "teeth") paint = toothOf(points, unit);
  else if (kind === "skin") paint = skinOf(unit, mouth);
  else if (kind === "gum" && /cartilage|caruncle/i.test(name)) {
    paint = (p) => ramp(CARUNCLE, noise(p, 6 / unit, 4));
  } else if (kind in FLESH) paint = (p) => ramp(FLESH[kind], noise(p, 6 / unit, 4));
  if (paint === null) return null;
  const shaded = kind === "teeth" || kind in FLESH;
  const in_eye = kind === "gum" && /cartilage|caruncle/i.test(name);
  const colors = new Float32Array(3 * points.length);
  points.forEach((p, v) => {
    const shade = shaded && !in_eye ? deep(p) : [1, 1, 1];
    colors.set(paint(p).map((value, i) => value * shade[i]), 3 * v);
  });
  return new BufferAttribute(colors, 3);
}

/** Place of a vertex on its eye: across and up, divided by the ball's radius; 1 on the front half. */
export function eyePlaces(skin) {
  const points = places(skin);
  const sides = balls(points);
  const out = new Float32Array(3 * points.length);
  for (const side of [0, 1]) {
    const own = points.filter((_, v) => sides[v] === side);
    if (own.length === 0) continue;
    const box = boxOf(own);
    const [x, y, z] = middleOf(box);
    const radius = Math.max((box.max[1] - box.min[1]) / 2, 1e-9);
    points.forEach((p, v) => {
      if (sides[v] === side) out.set([(p[0] - x) / radius, (p[1] - y) / radius, p[2] > z ? 1 : 0], 3 * v);
    });
  }
  return new BufferAttribute(out, 3);
}
