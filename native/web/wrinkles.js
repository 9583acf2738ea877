// SPDX-License-Identifier: MIT
// Strength of each wrinkle set at each place: one small texture, redrawn when the maps of a pose
// change. Red, green and blue are the sets, alpha is the flush.
import {
  HalfFloatType, LinearFilter, Mesh, NoBlending, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial,
  Vector4, WebGLRenderTarget,
} from "three";

const SIDE = 256;
const VERTEX = "varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }";
const FRAGMENT = `
varying vec2 place;
uniform sampler2D masks;
uniform float side;
uniform vec4 maps[COUNT]; // column, row, channel, value
void main() {
  vec4 sum = vec4(0.0);
  vec2 inside = clamp(place, RIM, 1.0 - RIM); // do not sample the neighbour's tile at the edges
  for (int i = 0; i < COUNT; ++i) {
    if (maps[i].w == 0.0) continue;
    float amount = maps[i].w * texture2D(masks, (inside + maps[i].xy) / side).r;
    sum += amount * vec4(equal(vec4(maps[i].z), vec4(0.0, 1.0, 2.0, 3.0)));
  }
  gl_FragColor = clamp(sum, 0.0, 1.0);
}`;

export class Wrinkles {
  /** In: the wrinkle data of looks.py, the texture of all masks. */
  constructor({ maps, side }, masks) {
    this.indices = maps.map(([index]) => index);
    this.places = maps.map(([, tile, channel]) => new Vector4(tile % side, Math.floor(tile / side), channel, 0));
    this.target = new WebGLRenderTarget(SIDE, SIDE, {
      type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter, depthBuffer: false,
    });
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT.replaceAll("COUNT", `${maps.length}`).replaceAll("RIM", "0.004"),
      uniforms: { masks: { value: masks }, side: { value: side }, maps: { value: this.places } },
      blending: NoBlending,
      depthTest: false,
    });
    this.scene = new Scene();
    this.scene.add(new Mesh(new PlaneGeometry(2, 2), material));
    this.camera = new OrthographicCamera();
    this.changed = true;
  }
  /** In: values of all animated maps. */
  pose(values) {
    this.indices.forEach((index, i) => {
      const value = values[index];
      if (this.places[i].w === value) return;
      this.places[i].w = value;
      this.changed = true;
    });
  }
  draw(renderer) {
    if (!this.changed) return;
    this.changed = false;
    renderer.setRenderTarget(this.target);
    renderer.render(this.scene, this.camera);
    renderer.setRenderTarget(null);
  }
}
