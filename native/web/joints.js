// SPDX-License-Identifier: MIT
// Matrices that move vertices, from the joint values of a pose.
import { Matrix4, Quaternion, Vector3 } from "three";

const AXES = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
// Left and right from the viewer's side: 0 left 1 right 2 up 3 down 4 front 5 back.
const DIRECTIONS = [[-1, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
const UNITS = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];

/** Converts the file's axes and units to the scene: metres, x to the viewer's right, y up, z to the front. */
export function toScene(skeleton) {
  const scale = skeleton.inMetres ? 1 : 0.01;
  return new Matrix4().makeBasis(
    ...Array.from(skeleton.axes, (axis) => new Vector3(...DIRECTIONS[axis]).multiplyScalar(scale)),
  );
}

export class Joints {
  constructor(skeleton) {
    this.skeleton = skeleton;
    this.scene = toScene(skeleton);
    this.order = this.parentsFirst();
    this.world = Array.from({ length: skeleton.count }, () => new Matrix4());
    this.parts = [new Vector3(), new Quaternion(), new Vector3(), new Quaternion()];
    this.turns = new Map(); // joint -> Quaternion about its own axes, see turn
    this.rest = new Float32Array(skeleton.count * skeleton.stride);
    this.place(this.rest);
    this.inverse = this.world.map((m) => m.clone().invert());
  }

  parentsFirst() {
    const { count, parents } = this.skeleton;
    const order = [];
    const seen = new Uint8Array(count);
    const add = (j) => {
      const chain = [];
      for (; !seen[j]; j = parents[j]) {
        seen[j] = 1;
        chain.push(j);
      }
      order.push(...chain.reverse());
    };
    for (let j = 0; j < count; ++j) add(j);
    return order;
  }

  /** Rotations of neck and head, which no pose has. In: [joint, [x, y, z, w]] relative to rest. */
  turn(pairs) {
    this.turns.clear();
    for (const [joint, q] of pairs) {
      if (q.some((part) => part !== 0)) this.turns.set(joint, new Quaternion(...q).normalize());
    }
  }

  /** Rotation of a joint relative to its parent. In: the same as place; out: a Quaternion, is written. */
  rotationOf(j, values, out) {
    const { neutral, stride, inRadians, order, signs } = this.skeleton;
    const turn = this.parts[3];
    out.identity();
    for (const axis of AXES[order]) {
      const angle = neutral[j * stride + 3 + axis] + values[j * stride + 3 + axis];
      turn.setFromAxisAngle(UNITS[axis], signs[axis] * (inRadians ? 1 : Math.PI / 180) * angle);
      out.premultiply(turn);
    }
    return out;
  }

  /** World matrices of a pose. In: values float32[joints, 9], deltas from neutral. */
  place(values) {
    const { neutral, parents, stride } = this.skeleton;
    const [position, rotation, scale] = this.parts;
    for (const j of this.order) {
      const at = j * stride;
      const sum = (k) => neutral[at + k] + values[at + k];
      position.set(sum(0), sum(1), sum(2));
      this.rotationOf(j, values, rotation);
      if (this.turns.has(j)) {
        const rest = this.rotationOf(j, this.rest, new Quaternion());
        rotation.premultiply(rest.clone().invert()).premultiply(this.turns.get(j)).premultiply(rest);
      }
      scale.set(sum(6), sum(7), sum(8));
      this.world[j].compose(position, rotation, scale);
      if (parents[j] !== j) this.world[j].premultiply(this.world[parents[j]]);
    }
  }

  /** Matrices from rest to the pose in the scene, per joint; the last one moves still vertices into the scene.
   * In: the same as place; out: float32[joints + 1, 16], columns, and a flag per matrix that changed. */
  pose(values, out, changed) {
    this.place(values);
    const product = new Matrix4();
    for (let j = 0; j <= this.world.length; ++j) {
      product.copy(this.scene);
      if (j < this.world.length) product.multiply(this.world[j]).multiply(this.inverse[j]);
      const { elements } = product;
      let differs = 0;
      for (let i = 0; i < 16; ++i) {
        const value = Math.fround(elements[i]);
        if (out[16 * j + i] !== value) differs = 1;
        out[16 * j + i] = value;
      }
      changed[j] = differs;
    }
  }
}
