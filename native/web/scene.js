// SPDX-License-Identifier: MIT
// Light, camera and materials: a portrait.
import {
  ACESFilmicToneMapping, Box3, CanvasTexture, Color, DirectionalLight, DoubleSide, Group,
  HemisphereLight, Mesh, MeshPhysicalMaterial, PCFSoftShadowMap, PerspectiveCamera, PMREMGenerator,
  Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1.0;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.scene = new Scene();
    const room = new PMREMGenerator(this.renderer);
    this.scene.environment = room.fromScene(new RoomEnvironment(), 0.06).texture;
    this.scene.environmentIntensity = 0.42;
    this.camera = new PerspectiveCamera(24, 1, 0.01, 20);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enableDamping = true;
    this.orbit.maxPolarAngle = 2.4;
    this.orbit.addEventListener("change", () => (this.dirty = true));
    this.face = new Group();
    this.scene.add(this.face);
    this.dirty = true;
  }

  /** A warm key from the front left, a cool rim from behind, little from everywhere. */
  light(size) {
    const at = (x, y, z) => this.middle.clone().add(new Vector3(x, y, z).multiplyScalar(size));
    const lamp = (color, strength, place) => {
      const light = new DirectionalLight(color, strength);
      light.position.copy(place);
      light.target.position.copy(this.middle);
      this.scene.add(light, light.target);
      return light;
    };
    const key = lamp(0xfff0e0, 2.1, at(1.6, 1.5, 2.2));
    key.castShadow = true;
    key.shadow.mapSize.set(2048, 2048);
    key.shadow.radius = 6;
    key.shadow.bias = -0.0004;
    key.shadow.normalBias = size * 0.004;
    const box = key.shadow.camera;
    [box.left, box.right, box.top, box.bottom] = [-size, size, size, -size];
    [box.near, box.far] = [0.1 * size, 6 * size];
    lamp(0xbfd6ff, 1.5, at(-1.8, 0.9, -1.9));
    lamp(0xffe6d2, 0.35, at(-1.7, 0.1, 1.6));
    this.scene.add(new HemisphereLight(0xdfe8f5, 0x5a463c, 0.35));
  }

  /** Looks at the face from the front. In: the meshes' heads, widest first. */
  frame() {
    const box = new Box3().setFromObject(this.face);
    const height = box.max.y - box.min.y;
    // A bust reaches down to the chest: the face is in its upper half.
    this.middle = new Vector3((box.min.x + box.max.x) / 2, box.max.y - 0.42 * Math.min(height, 0.36),
      (box.min.z + box.max.z) / 2);
    this.size = Math.min(height, 0.4);
    this.light(this.size);
    this.home();
  }
  home() {
    const tall = this.camera.aspect < 1 ? 1 / this.camera.aspect : 1;
    const distance = (this.size * 0.62 * Math.max(1, tall * 0.72)) / Math.tan((this.camera.fov * Math.PI) / 360);
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
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
  }
}

/** An iris on a ball, where the face brings no picture of one: the pupil lies at (0.5, 0.5). */
function paintedEye() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 512;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#e9e4e0";
  pen.fillRect(0, 0, 512, 512);
  const ring = (radius, stops) => {
    const paint = pen.createRadialGradient(256, 256, 0, 256, 256, radius);
    for (const [at, color] of stops) paint.addColorStop(at, color);
    pen.fillStyle = paint;
    pen.beginPath();
    pen.arc(256, 256, radius, 0, 2 * Math.PI);
    pen.fill();
  };
  ring(86, [[0, "#8b6a3d"], [0.55, "#6b4a28"], [0.86, "#3a2716"], [1, "rgba(40,28,20,0)"]]);
  ring(34, [[0, "#050404"], [0.86, "#070505"], [1, "rgba(10,6,4,0)"]]);
  return textureOf(canvas);
}

function textureOf(image) {
  const texture = new CanvasTexture(image);
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = 8;
  return texture;
}

async function picture(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  return textureOf(image);
}

const KINDS = [
  [/lash/i, () => ({ color: 0x120c09, roughness: 0.7, side: DoubleSide })],
  [/eyeshell|eye_?edge|cartilage|saliva|tear/i,
    () => ({ color: 0xffffff, roughness: 0.05, transparent: true, opacity: 0.08, depthWrite: false })],
  [/eye/i, () => ({ color: 0xffffff, roughness: 0.12, clearcoat: 1, clearcoatRoughness: 0.03 })],
  [/teeth|tooth/i, () => ({ color: 0xd8cdb8, roughness: 0.28, clearcoat: 0.6, clearcoatRoughness: 0.2 })],
  [/tongue/i, () => ({ color: 0x9c4a48, roughness: 0.42, clearcoat: 0.3, clearcoatRoughness: 0.4 })],
  [/./, () => ({ color: 0xc9a08a, roughness: 0.52, sheen: 0.35, sheenRoughness: 0.5,
    sheenColor: new Color(0xd98c78), specularIntensity: 0.55, clearcoat: 0.06, clearcoatRoughness: 0.45 })],
];

/** In: name of a mesh; pictures of it by use ("color", "alpha"), data URLs. */
export async function materialOf(name, pictures) {
  const [kind, settings] = KINDS.find(([pattern]) => pattern.test(name));
  const material = new MeshPhysicalMaterial(settings());
  if (pictures.color) {
    material.map = await picture(pictures.color);
    material.color.set(0xffffff);
  } else if (String(kind) === "/eye/i") {
    material.map = paintedEye();
  }
  if (pictures.alpha) {
    material.alphaMap = await picture(pictures.alpha);
    material.transparent = true;
    material.depthWrite = false;
  }
  return material;
}

export function meshOf(skin, material) {
  const mesh = new Mesh(skin.geometry, material);
  mesh.castShadow = !material.transparent;
  mesh.receiveShadow = !material.transparent;
  mesh.frustumCulled = false;
  return mesh;
}
