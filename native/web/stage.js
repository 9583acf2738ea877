// SPDX-License-Identifier: MIT
// Light and camera of a portrait.
import {
  AgXToneMapping, Box3, DirectionalLight, Group, HemisphereLight, PCFSoftShadowMap,
  PerspectiveCamera, PMREMGenerator, Scene, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.toneMapping = AgXToneMapping;
    this.renderer.toneMappingExposure = 1.0;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.autoUpdate = false; // lights do not move, so the shadow map stays valid while the camera moves
    this.moved = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.scene = new Scene();
    const room = new PMREMGenerator(this.renderer);
    this.scene.environment = room.fromScene(new RoomEnvironment(), 0.06).texture;
    this.scene.environmentIntensity = 0.13;
    this.camera = new PerspectiveCamera(24, 1, 0.01, 20);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enableDamping = true;
    this.orbit.maxPolarAngle = 2.4;
    this.orbit.addEventListener("change", () => (this.dirty = true));
    this.face = new Group();
    this.wrinkles = [];
    this.scene.add(this.face);
    this.dirty = true;
  }

  /** A warm key light from the viewer's left, a cool rim light from behind, a little from everywhere: the studio of the add-on. */
  light(size) {
    const at = (x, y, z) => this.middle.clone().add(new Vector3(x, y, z).multiplyScalar(size));
    const lamp = (color, strength, place) => {
      const light = new DirectionalLight(color, strength);
      light.position.copy(place);
      light.target.position.copy(this.middle);
      this.scene.add(light, light.target);
      return light;
    };
    const key = lamp(0xffe9d2, 3.6, at(-1.6, 1.5, 2.0));
    const rim = lamp(0xcfe0ff, 1.8, at(1.3, 1.2, -2.4));
    // Without shadows the rim light would shine through the head onto the far side of the nose.
    for (const [light, side] of [[key, 2048], [rim, 1024]]) {
      light.castShadow = true;
      light.shadow.mapSize.set(side, side);
      light.shadow.radius = 6;
      light.shadow.bias = -0.0004;
      light.shadow.normalBias = size * 0.006;
      const box = light.shadow.camera;
      [box.left, box.right, box.top, box.bottom] = [-size, size, size, -size];
      [box.near, box.far] = [0.1 * size, 6 * size];
    }
    lamp(0xffe6d2, 0.3, at(1.8, 0.2, 1.6));
    this.scene.add(new HemisphereLight(0xdfe8f5, 0x5a463c, 0.12));
  }

  /** Points the camera at the face from the front. */
  frame() {
    const box = new Box3().setFromObject(this.face);
    const height = box.max.y - box.min.y;
    // A bust reaches down to the chest, so the face is in its upper half.
    this.middle = new Vector3((box.min.x + box.max.x) / 2, box.max.y - 0.42 * Math.min(height, 0.36),
      (box.min.z + box.max.z) / 2);
    this.size = Math.min(height, 0.4);
    this.light(this.size);
    this.home();
  }
  home() {
    const tall = this.camera.aspect < 1 ? 1 / this.camera.aspect : 1;
    const distance = (this.size * 0.53 * Math.max(1, tall * 0.72)) / Math.tan((this.camera.fov * Math.PI) / 360);
    this.orbit.target.copy(this.middle);
    this.camera.position.copy(this.middle).add(new Vector3(0.16, 0.02, 1).multiplyScalar(distance));
    this.orbit.minDistance = distance * 0.25;
    this.orbit.maxDistance = distance * 4;
    this.camera.near = distance * 0.02;
    this.camera.far = distance * 20;
    this.orbit.update();
    this.dirty = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }
  draw() {
    this.orbit.update();
    if (!this.dirty) return false;
    this.dirty = false;
    for (const wrinkles of this.wrinkles) wrinkles.draw(this.renderer);
    this.renderer.shadowMap.needsUpdate = this.moved;
    this.moved = false;
    this.renderer.render(this.scene, this.camera);
    return true;
  }
}
