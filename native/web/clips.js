// SPDX-License-Identifier: MIT
// Takes and sounds that the user drops on a face: .csv, .rzc and sounds.
import { FaceError } from "./library.js";

const RATE = 60;
const ANGLES = /^(head|neck)\.(yaw|pitch|roll)$/;
const TIME = /^(time|t|seconds|second|sec|timestamp)\b[\s_]*\(?(ms|milliseconds|s|sec|seconds)?\)?$/i;

/** `EyeBlink_L`, `eyeBlinkLeft` and `eyeblinkL` are one name. */
const loose = (name) =>
  name.toLowerCase().replace(/^(blendshapes?|arkit|face)[._]/, "").replace(/[_\s]/g, "")
    .replace(/left$/, "l").replace(/right$/, "r");

function cells(line, delimiter) {
  const found = [];
  let cell = "";
  let quoted = false;
  for (const sign of line) {
    if (sign === '"') quoted = !quoted;
    else if (sign === delimiter && !quoted) [cell] = [found.push(cell) && ""];
    else cell += sign;
  }
  return [...found, cell].map((text) => text.trim());
}

/** Seconds from hours:minutes:seconds:frames. In: cells of one column. */
function timecodes(column) {
  const parts = column.map((text) => text.split(/[:;]/).map(Number));
  const most = parts.reduce((high, part) => Math.max(high, part[3] ?? 0), 0);
  const rate = [24, 25, 30, 48, 50, 60, 120, 240].find((known) => known > most) ?? 1000;
  return parts.map(([h, m, s, f = 0]) => 3600 * h + 60 * m + s + f / rate);
}

function timesOf(header, rows, name) {
  const at = header.findIndex((title) => TIME.test(title) || /^timecode$/i.test(title));
  if (at < 0) throw new FaceError(`${name}: a column time or Timecode was expected, found ${header.slice(0, 3).join(", ")}`);
  const column = rows.map((row) => row[at]);
  if (column[0].includes(":")) return timecodes(column);
  const factor = /ms|milliseconds/i.test(header[at]) ? 0.001 : 1;
  return column.map((text) => factor * Number(text.replace(",", ".")));
}

/** A table with a column per curve and one of times. */
function tableOf(text, name) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r?\n/).filter((line) => line.trim() && !/^(#|\/\/|%|sep=)/i.test(line));
  if (lines.length < 2) throw new FaceError(`${name}: a header and a row at least were expected, found ${lines.length} lines`);
  const delimiter = [",", "\t", ";", "|"].reduce((best, sign) =>
    cells(lines[0], sign).length > cells(lines[0], best).length ? sign : best);
  const header = cells(lines[0], delimiter);
  const rows = lines.slice(1).map((line) => cells(line, delimiter)).filter((row) => row.length === header.length);
  if (rows.length === 0) throw new FaceError(`${name}: rows of ${header.length} cells were expected, found none`);
  const times = timesOf(header, rows, name);
  const curves = header.map((_, i) => Float32Array.from(rows, (row) => Number(row[i].replace(",", "."))));
  const kept = header.map((_, i) => i).filter((i) => curves[i].every(Number.isFinite));
  return { names: kept.map((i) => header[i]), curves: kept.map((i) => curves[i]), times };
}

/** Loudness of a sound as jaw opening, and brightness as spread or rounded lips. */
async function loudness(file) {
  const context = new OfflineAudioContext(1, 1, 16000);
  let sound;
  try {
    sound = await context.decodeAudioData(await file.arrayBuffer());
  } catch {
    throw new FaceError(`${file.name}: a sound that this browser plays was expected`);
  }
  const samples = sound.getChannelData(0);
  const width = Math.max(Math.round(sound.sampleRate / RATE), 1);
  const count = Math.max(Math.ceil(samples.length / width), 2);
  const [loud, sharp] = [new Float32Array(count), new Float32Array(count)];
  for (let f = 0; f < count; ++f) {
    const own = samples.subarray(f * width, (f + 1) * width);
    let [power, turns] = [0, 0];
    for (let i = 0; i < own.length; ++i) {
      power += own[i] * own[i];
      if (i > 0 && own[i] > 0 !== own[i - 1] > 0) turns += 1;
    }
    loud[f] = Math.sqrt(power / Math.max(own.length, 1));
    sharp[f] = Math.min(turns / Math.max(own.length, 1) / 0.25, 1);
  }
  const smooth = (list, f) => (list[Math.max(f - 2, 0)] + list[Math.max(f - 1, 0)] + 2 * list[f] + list[Math.min(f + 1, count - 1)]) / 5;
  const most = loud.reduce((a, b) => Math.max(a, b), 1e-4);
  const curve = (value) => Float32Array.from({ length: count }, (_, f) => value(smooth(loud, f) / most, smooth(sharp, f)));
  return {
    names: ["jawOpen", "mouthStretchLeft", "mouthStretchRight", "mouthFunnel"],
    curves: [
      curve((l, s) => 0.55 * l ** 0.7 * (1 - 0.5 * s)),
      curve((l, s) => 0.35 * l * s),
      curve((l, s) => 0.35 * l * s),
      curve((l, s) => 0.3 * l * (1 - s)),
    ],
    times: Float64Array.from({ length: count }, (_, f) => f / RATE),
  };
}

/** Curves of a file as weighted sums of raw controls and angles. */
function mapped({ names, curves }, { rows, shares }, controls) {
  const own = new Map(controls.map((name, i) => [name, i]));
  const known = new Map(Object.entries(rows).map(([name, row]) => [loose(name), row]));
  const isOwn = names.some((name) => own.has(name));
  const sums = new Map();
  names.forEach((name, i) => {
    const direct = own.has(name) ? own.get(name) : ANGLES.test(name) ? name : undefined;
    const row = direct !== undefined ? [[direct, 1]] : isOwn ? [] : (known.get(loose(name)) ?? []);
    for (const [place, weight] of row) {
      if (!sums.has(place)) sums.set(place, new Float32Array(curves[i].length));
      const sum = sums.get(place);
      for (let f = 0; f < sum.length; ++f) sum[f] += weight * curves[i][f];
    }
  });
  for (const [part, whole] of isOwn ? [] : shares) {
    const [a, b] = [sums.get(part), sums.get(whole)];
    if (!a || !b) continue;
    for (let f = 0; f < a.length; ++f) a[f] = Math.min(Math.max(a[f] / Math.max(b[f], 0.02), 0), 1);
  }
  return sums;
}

/** Rotation of head or neck about the face's axes: yaw about z, pitch about -x, roll about y. */
function turnOf([yaw, pitch, roll], share) {
  const [sy, sp, sr] = [yaw, pitch, roll].map((angle) => Math.sin(angle / 2));
  const [cy, cp, cr] = [yaw, pitch, roll].map((angle) => Math.cos(angle / 2));
  const q = [
    -cp * sr * sy - cr * cy * sp, cp * cy * sr - cr * sp * sy,
    cp * cr * sy - cy * sp * sr, cp * cr * cy + sp * sr * sy,
  ].map((part, _, all) => (all[3] < 0 ? -part : part));
  const sine = Math.hypot(q[0], q[1], q[2]);
  const half = share * Math.atan2(sine, q[3]);
  return [...q.slice(0, 3).map((part) => (sine > 0 ? (part / sine) * Math.sin(half) : 0)), Math.cos(half)];
}

/** Columns of the neck and head joints, and of the raw controls that hold their rotation. */
function addTurns(sums, bones, count) {
  const turns = [];
  for (const { joint, bone, share, axes, controls } of bones) {
    const angles = ["yaw", "pitch", "roll"].map((way) => sums.get(`${bone}.${way}`));
    if (angles.every((curve) => curve === undefined)) continue;
    const columns = Array.from({ length: 4 }, () => new Float32Array(count));
    for (let f = 0; f < count; ++f) {
      const [x, y, z, w] = turnOf(angles.map((curve) => curve?.[f] ?? 0), share);
      for (let k = 0; k < 3; ++k) columns[k][f] = axes[3 * k] * x + axes[3 * k + 1] * y + axes[3 * k + 2] * z;
      columns[3][f] = w;
    }
    controls.forEach((control, part) => sums.set(control, columns[part]));
    turns.push([joint, columns]);
  }
  return turns;
}

/** A curve resampled at even times. */
function resampled(curve, times, count, rate) {
  const out = new Float32Array(count);
  for (let f = 0, i = 0; f < count; ++f) {
    const at = times[0] + f / rate;
    while (i + 2 < times.length && times[i + 1] <= at) i += 1;
    const next = Math.min(i + 1, times.length - 1);
    const span = times[next] - times[i];
    const share = span > 0 ? Math.min(Math.max((at - times[i]) / span, 0), 1) : 0;
    out[f] = (1 - share) * curve[i] + share * curve[next];
  }
  return out;
}

/** In: content of a file, table of the page, names of raw controls, file name.
 * Out: the clip and its values, see player.js. */
export function clipOf(found, { captures, bones }, controls, name) {
  const { times } = found;
  const length = times[times.length - 1] - times[0];
  if (!(length >= 0)) throw new FaceError(`${name}: times that rise were expected`);
  const count = Math.max(Math.round(length * RATE) + 1, 1);
  const even = new Map();
  for (const [place, curve] of mapped(found, captures, controls)) even.set(place, resampled(curve, times, count, RATE));
  const turns = addTurns(even, bones, count);
  const places = [...even.keys()].filter((place) => typeof place === "number");
  if (places.length + turns.length === 0) {
    throw new FaceError(`${name}: a curve of ARKit's names or of this face's raw controls was expected, found ${found.names.slice(0, 3).join(", ")}`);
  }
  const columns = [...places.map((place) => even.get(place)), ...turns.flatMap(([, own]) => own)];
  const values = new Float32Array(count * columns.length);
  columns.forEach((column, i) => column.forEach((value, f) => (values[f * columns.length + i] = value)));
  return { clip: { rate: RATE, frames: count, controls: places, turns: turns.map(([joint]) => joint) }, values };
}

/** In: a File, the viewer. Out: as clipOf. */
export async function readClip(file, { library, about, controls }) {
  const ending = file.name.toLowerCase().split(".").pop();
  let found;
  if (ending === "rzc") found = library.clip(new Uint8Array(await file.arrayBuffer()));
  else if (ending === "csv") found = tableOf(await file.text(), file.name);
  else if (["wav", "mp3", "ogg", "m4a"].includes(ending)) found = await loudness(file);
  else throw new FaceError(`${file.name}: a name ending in .csv, .rzc or .wav was expected`);
  return clipOf(found, about, controls, file.name);
}

export { tableOf };
