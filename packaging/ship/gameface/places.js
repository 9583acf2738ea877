// SPDX-License-Identifier: MIT
// What a client has of a face: its vertices, its joints, its weights.
import * as THREE from 'three';

const packed = (numbers) => {
  const bytes = new Uint8Array(numbers.buffer);
  let text = '';
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(text);
};

/** The meshes below an object. */
export function meshesOf(scene) {
  const meshes = [];
  scene.traverse((one) => { if (one.isMesh) meshes.push(one); });
  return meshes;
}

/** Where each vertex of each mesh is in the scene: float32 as base64. */
export function placesOf(meshes) {
  const point = new THREE.Vector3();
  return Object.fromEntries(meshes.map((mesh) => {
    const count = mesh.geometry.attributes.position.count;
    const out = new Float32Array(3 * count);
    for (let i = 0; i < count; i += 1) {
      mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld).toArray(out, 3 * i);
    }
    return [mesh.name, packed(out)];
  }));
}

/** The same with the weights of each mesh's targets and the joints, all of one moment. */
export function stateOf(root, meshes) {
  root.updateMatrixWorld(true);
  const joints = {};
  for (const mesh of meshes) {
    for (const bone of mesh.skeleton?.bones ?? []) joints[bone.name] = bone.matrixWorld.toArray();
  }
  const weights = Object.fromEntries(meshes.map((mesh) => [mesh.name, Object.fromEntries(
    Object.entries(mesh.morphTargetDictionary ?? {}).map(([n, i]) => [n, mesh.morphTargetInfluences[i] ?? 0]))]));
  return { places: placesOf(meshes), joints, weights };
}

/** Draws an object from the front of its head, which is at this height; the triangles that were drawn. */
export function drawn(object, height) {
  const renderer = new THREE.WebGLRenderer({ antialias: true });
  renderer.setSize(innerWidth, innerHeight);
  document.body.replaceChildren(renderer.domElement);
  const stage = new THREE.Scene();
  stage.background = new THREE.Color(0x777777);
  stage.add(object, new THREE.HemisphereLight(0xffffff, 0x666666, 2.2));
  const sun = new THREE.DirectionalLight(0xffffff, 2);
  sun.position.set(0.5, 1, 1.5);
  stage.add(sun);
  const camera = new THREE.PerspectiveCamera(24, innerWidth / innerHeight, 0.01, 10);
  camera.position.set(0, height, 1.1);
  camera.lookAt(0, height, 0);
  renderer.render(stage, camera);
  return renderer.info.render.triangles;
}
