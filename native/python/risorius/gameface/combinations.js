// SPDX-License-Identifier: MIT
// Drives the morph targets that correct sums of other targets: targets that are on together,
// targets that are half on, and targets that act on top of another one, such as mouthClose on
// jawOpen. Works with three.js, three-vrm, and other libraries whose objects have
// `morphTargetDictionary` and `morphTargetInfluences`.
//
//   import { Combinations } from './combinations.js';
//   const combinations = new Combinations(await (await fetch('face.combinations.json')).json(), scene);
//   // each frame, after the targets were set and before the scene is drawn:
//   combinations.update();

const FORMAT = 'risorius.combinations';
const VERSION = 1;
const LEAST = 0.02; // smallest weight of jawOpen by which mouthClose is divided
const KINDS = {
  product: { drivers: 2, weight: (a, b) => a * b },
  half: { drivers: 1, weight: (a) => 4 * a * (1 - a) },
  below: { drivers: 2, weight: (a, b) => 4 * a * (1 - b) },
  share: { drivers: 2, weight: (a, b) => 4 * a * Math.max(0, b - a) },
  cubic: { drivers: 1, weight: (a) => 32 / 3 * a * (1 - a) * (1 - 2 * a) },
  early: { drivers: 2, weight: (a, b) => 4 * a * (1 - a) * b },
  late: { drivers: 2, weight: (a, b) => 4 * a * b * (1 - b) },
  middle: { drivers: 2, weight: (a, b) => 16 * a * b * (1 - a) * (1 - b) },
  triple: { drivers: 3, weight: (a, b, c) => a * b * c },
  shut: { drivers: 3, weight: (a, b, c) => Math.min(1, a / Math.max(b, LEAST)) * (1 - b) * c },
};

/** The weight of a combination's target from the weights (0 to 1) of its driving targets. */
export function weightOf(kind, weights) {
  const inside = weights.map((w) => Math.min(1, Math.max(0, w)));
  return KINDS[kind].weight(...inside);
}

/** The rows of a table of combinations; throws an Error if the table is invalid. */
export function rowsOf(table) {
  if (!table || table.format !== FORMAT) throw new Error(`combinations: format ${FORMAT} was expected`);
  if (table.version !== VERSION) {
    throw new Error(`combinations: version ${VERSION} was expected, found ${table.version}`);
  }
  for (const { target, of, weight } of table.combinations) {
    if (!Object.hasOwn(KINDS, weight)) {
      const known = Object.keys(KINDS).join(', ');
      throw new Error(`combinations: ${target}: a weight of ${known} was expected, found ${weight}`);
    }
    const many = KINDS[weight].drivers;
    if (typeof target !== 'string' || !Array.isArray(of) || of.length !== many) {
      throw new Error(`combinations: ${target}: ${many} targets that drive it were expected`);
    }
  }
  return table.combinations;
}

/** The meshes with morph targets of a three.js object, or of a list of meshes. */
function meshesOf(scene) {
  const found = [];
  const take = (one) => {
    if (one.morphTargetDictionary && one.morphTargetInfluences) found.push(one);
  };
  if (Array.isArray(scene)) scene.forEach(take);
  else scene.traverse(take);
  return found;
}

export class Combinations {
  /**
   * @param table the parsed .combinations.json
   * @param scene a three.js object that contains the face, or a list of its meshes
   */
  constructor(table, scene) {
    const rows = rowsOf(table);
    this.plans = [];
    const meshes = meshesOf(scene);
    // A mesh may lack a target that does not move it; its weight is then read from another mesh.
    const sources = new Map();
    for (const mesh of meshes) {
      for (const [name, index] of Object.entries(mesh.morphTargetDictionary)) {
        if (!sources.has(name)) sources.set(name, { mesh, index });
      }
    }
    for (const { target, of, weight } of rows) {
      const drivers = of.map((name) => sources.get(name));
      const driven = [];
      for (const mesh of meshes) {
        const index = mesh.morphTargetDictionary[target];
        if (index !== undefined) driven.push({ mesh, index });
      }
      if (driven.length && drivers.every(Boolean)) this.plans.push({ weight, drivers, driven });
    }
  }

  /** Sets the weights of the combinations' targets. Returns the number of weights above 0. */
  update() {
    let on = 0;
    for (const { weight, drivers, driven } of this.plans) {
      const value = weightOf(weight, drivers.map(({ mesh, index }) => mesh.morphTargetInfluences[index]));
      for (const { mesh, index } of driven) mesh.morphTargetInfluences[index] = value;
      if (value !== 0) on += 1;
    }
    return on;
  }
}
