// SPDX-License-Identifier: MIT
// Materials by the kind of mesh, with its textures.
import {
  AdditiveBlending, Color, DoubleSide, Mesh, MeshPhysicalMaterial, NoColorSpace, ShaderChunk,
  SRGBColorSpace, Texture,
} from "three";
import { colorsOf, eyePlaces } from "./paint.js";
import { Wrinkles } from "./wrinkles.js";

const linear = (r, g, b) => new Color().setRGB(r, g, b);

/** A chunk of three.js with a part replaced; throws at once if this three.js lacks the part. */
function replaced(source, ...pairs) {
  for (const [from, to] of pairs) {
    if (!source.includes(from)) throw new Error(`three.js has no ${JSON.stringify(from)} here any more`);
    source = source.replace(from, to);
  }
  return source;
}

/** Changes the shaders of a material. In: name of the change, pairs for the fragment and vertex shaders. */
function change(material, name, fragment, vertex = [], uniforms = {}) {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.fragmentShader = replaced(shader.fragmentShader, ...fragment);
    shader.vertexShader = replaced(shader.vertexShader, ...vertex);
  };
  material.customProgramCacheKey = () => name;
}

// Light scatters in skin: the edges of light and of shadows are red.
const SOFT_SKIN = replaced(ShaderChunk.lights_physical_pars_fragment,
  ["float dotNL = saturate( dot( geometryNormal, directLight.direction ) );",
    `float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 wander = vec3( 0.3, 0.1, 0.05 );
	vec3 softNL = saturate( ( dot( geometryNormal, directLight.direction ) + wander ) / ( 1.0 + wander ) );`],
  ["reflectedLight.directDiffuse += irradiance *", "reflectedLight.directDiffuse += softNL * directLight.color *"]);
const SOFT_SHADOW = replaced(ShaderChunk.lights_fragment_begin,
  ["? getShadow( directionalShadowMap[ i ]", "? pow( vec3( getShadow( directionalShadowMap[ i ]"],
  ["vDirectionalShadowCoord[ i ] ) : 1.0;", "vDirectionalShadowCoord[ i ] ) ), vec3( 0.72, 1.05, 1.12 ) ) : vec3( 1.0 );"]);

// Nothing shades reflections of the room: the side of a nose would shine through the head, a tongue through lips.
const DULL_ROOM = replaced(ShaderChunk.lights_fragment_maps,
  ["radiance += iblRadiance", "radiance += 0.3 * iblRadiance"],
  ["clearcoatRadiance += getIBL", "clearcoatRadiance += 0.3 * getIBL"]);

const WRINKLED = ([number, offset]) => `
	vec3 crease${number} = texture2D( wrinkles${number}, vNormalMapUv ).xyz;
	skinNormal = ${offset
    ? `skinNormal + amounts[${number - 1}] * ( crease${number} - 0.5 )`
    : `mix( skinNormal, crease${number}, amounts[${number - 1}] )`};`;

function skin(material, wrinkles, sets) {
  const fragment = [
    ["#include <lights_physical_pars_fragment>", SOFT_SKIN],
    ["#include <lights_fragment_begin>", SOFT_SHADOW],
    ["#include <lights_fragment_maps>", DULL_ROOM],
  ];
  const uniforms = {};
  let name = "skin";
  // The tone curve removes colour from bright areas.
  fragment.push(["#include <color_fragment>", `#include <color_fragment>
	diffuseColor.rgb = max( mix( vec3( dot( diffuseColor.rgb, vec3( 0.2126, 0.7152, 0.0722 ) ) ), diffuseColor.rgb, 1.13 ), 0.0 );`]);
  if (wrinkles && material.map) {
    uniforms.amountMap = { value: wrinkles.target.texture };
    fragment.push(["#include <map_fragment>", `#include <map_fragment>
	vec4 amounts = texture2D( amountMap, vMapUv );
	diffuseColor.rgb *= mix( vec3( 1.0 ), vec3( 1.0, 0.42, 0.38 ), amounts.a );`]);
    let names = "uniform sampler2D amountMap;\n";
    if (material.normalMap) {
      for (const [number, , texture] of sets) {
        uniforms[`wrinkles${number}`] = { value: texture };
        names += `uniform sampler2D wrinkles${number};\n`;
      }
      fragment.push(["#include <normal_fragment_maps>", replaced(ShaderChunk.normal_fragment_maps,
        ["vec3 mapN = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;",
          `vec3 skinNormal = texture2D( normalMap, vNormalMapUv ).xyz;${sets.map(WRINKLED).join("")}
	vec3 mapN = skinNormal * 2.0 - 1.0;`])]);
    }
    fragment.push(["#include <map_pars_fragment>", `#include <map_pars_fragment>\n${names}`]);
    name += JSON.stringify(sets.map(([number, offset]) => [number, offset]));
  }
  change(material, name, fragment, [], uniforms);
}

// Lids and lashes shade the ball below the upper lid and in the corners.
const LIDS = ["#include <lights_physical_fragment>", `
	vec3 outward = inverseTransformDirection( normal, viewMatrix );
	float open = 1.0 - smoothstep( 0.02, 0.62, outward.y ) * 0.62;
	open *= 1.0 - smoothstep( 0.35, 0.85, abs( outward.x ) ) * 0.4;
	diffuseColor.rgb *= vec3( open, mix( 1.0, open, 1.08 ), mix( 1.0, open, 1.12 ) );
#include <lights_physical_fragment>`];

// Pupil, iris with fibres, limbus and sclera, by place on the ball.
const IRIS = ["#include <map_fragment>", `
	float away = length( eyePlace.xy ) + 2.0 * ( 1.0 - eyePlace.z );
	vec2 turned = normalize( eyePlace.xy + 1e-5 );
	float fibres = 0.5 + 0.25 * sin( 41.0 * atan( turned.y, turned.x ) + 7.0 * sin( 9.0 * turned.x ) )
		+ 0.25 * sin( 67.0 * atan( turned.y, turned.x ) + 5.0 * sin( 13.0 * turned.y ) );
	vec3 iris = mix( vec3( 0.19, 0.10, 0.045 ), vec3( 0.055, 0.066, 0.05 ), saturate( 4.0 * away + 0.6 * fibres - 0.9 ) );
	iris *= 0.35 + 2.16 * fibres * fibres;
	iris = mix( vec3( 0.002 ), iris, smoothstep( 0.145, 0.165, away ) );
	iris = mix( iris, vec3( 0.022, 0.022, 0.02 ), smoothstep( 0.37, 0.455, away ) );
	vec3 sclera = mix( vec3( 0.72, 0.66, 0.62 ), vec3( 0.56, 0.39, 0.34 ), smoothstep( 0.5, 1.0, away ) );
	diffuseColor.rgb = mix( iris, sclera, smoothstep( 0.455, 0.51, away ) );`];

function eyes(material) {
  if (material.map) return change(material, "eyes", [LIDS]);
  change(material, "iris",
    [LIDS, IRIS, ["#include <common>", "#include <common>\nvarying vec3 eyePlace;"]],
    [["#include <common>", "#include <common>\nattribute vec3 place;\nvarying vec3 eyePlace;"],
      ["#include <begin_vertex>", "#include <begin_vertex>\n\teyePlace = place;"]]);
}

// Both sides of a card use the skin's normal.
const OUTWARD = ["#include <normal_fragment_begin>", replaced(ShaderChunk.normal_fragment_begin,
  ["float faceDirection = gl_FrontFacing ? 1.0 : - 1.0;", "float faceDirection = 1.0;"])];

// Hairs are finer than texels, and light through them shows their colour.
const FINE = ["#include <alphamap_fragment>", `#include <alphamap_fragment>
	diffuseColor.a = pow( diffuseColor.a, 1.2 );
	diffuseColor.rgb *= 1.4;`];

// Cards without a texture: hairs side by side along the card, like the add-on's lash nodes.
const HAIRS = ["#include <alphamap_fragment>", `
	float hair = 0.0;
	for ( int i = 0; i < 3; ++ i ) {
		float across = vUv.x * 90.0 * float( i + 1 ) + 3.0 * float( i ) * vUv.y;
		float cell = floor( across );
		float one = fract( sin( cell * 127.1 ) * 43758.5453 ), next = fract( sin( ( cell + 1.0 ) * 127.1 ) * 43758.5453 );
		hair += mix( one, next, smoothstep( 0.0, 1.0, fract( across ) ) ) / 3.0;
	}
	diffuseColor.a *= smoothstep( 0.44, 0.58, hair );
	diffuseColor.rgb *= 0.6 + 0.8 * hair;`];

const KINDS = {
  skin: { roughness: 0.52, specularIntensity: 0.65 },
  eyes: { roughness: 0.34, clearcoat: 0.5, clearcoatRoughness: 0.06, specularIntensity: 0.4 },
  teeth: { roughness: 0.3, clearcoat: 0.35, clearcoatRoughness: 0.12 },
  tongue: { roughness: 0.42, clearcoat: 0.5, clearcoatRoughness: 0.16 },
  gum: { roughness: 0.42, clearcoat: 0.5, clearcoatRoughness: 0.16 },
  cloth: { color: linear(0.055, 0.065, 0.08), roughness: 0.85, specularIntensity: 0.5 },
  hair: { color: linear(0.06, 0.045, 0.035), roughness: 0.55, metalness: 0.12, specularIntensity: 0.25, side: DoubleSide },
  lashes: { color: linear(0.012, 0.007, 0.005), roughness: 0.6, specularIntensity: 0.3, side: DoubleSide },
  // A film shows only its reflection.
  wet: { color: 0x000000, roughness: 0.03, transparent: true, blending: AdditiveBlending, depthWrite: false },
};

const INSIDE = ["teeth", "tongue", "gum"];

export class Surfaces {
  /** In: materials and textures of the table; bytes of all textures. */
  constructor({ materials, pictures }, bytes) {
    this.materials = materials;
    this.pictures = [];
    let at = 0;
    for (const [media, size] of pictures) {
      this.pictures.push(new Blob([bytes.subarray(at, at + size)], { type: media }));
      at += size;
    }
    this.textures = new Map();
    this.made = new Map();
    this.wrinkles = [];
  }

  async texture(number, space) {
    const key = `${number} ${space}`;
    if (!this.textures.has(key)) {
      const image = new Image();
      image.src = URL.createObjectURL(this.pictures[number]);
      await image.decode();
      URL.revokeObjectURL(image.src);
      const texture = new Texture(image);
      texture.colorSpace = space;
      texture.anisotropy = 8;
      texture.needsUpdate = true;
      this.textures.set(key, texture);
    }
    return this.textures.get(key);
  }

  /** Objects of a part. In: number of its material, name of its mesh, its skin at rest, the face. */
  async objects(number, name, own, face) {
    const about = this.materials[number];
    if (about.kind === "eyes" && about.color === undefined) own.geometry.setAttribute("place", eyePlaces(own));
    if (about.color === undefined) {
      const colors = colorsOf(own, name, face);
      if (colors !== null) own.geometry.setAttribute("color", colors);
    }
    if (!this.made.has(number)) this.made.set(number, this.material(about));
    const list = await this.made.get(number);
    return list.map((material, layer) => {
      const object = new Mesh(own.geometry, material);
      object.castShadow = layer === 0 && about.kind !== "wet" && about.kind !== "lashes";
      object.receiveShadow = about.kind !== "wet";
      object.frustumCulled = false;
      object.renderOrder = layer + (about.kind === "wet" ? 3 : 0);
      return object;
    });
  }

  /** Cards have two: the opaque inside of hairs, and their soft rims over it. */
  async material(about) {
    const { kind } = about;
    const settings = { ...KINDS[kind] };
    const material = new MeshPhysicalMaterial(settings);
    const use = async (role, space) => (about[role] === undefined ? null : this.texture(about[role], space));
    material.map = await use("color", SRGBColorSpace);
    material.normalMap = await use("normal", NoColorSpace);
    material.roughnessMap = await use("roughness", NoColorSpace);
    if (material.roughnessMap) material.roughness = 1;
    const painted = ["skin", ...INSIDE].includes(kind) && !material.map;
    material.vertexColors = painted;
    if (material.map) material.color.set(0xffffff);
    if (material.normalMap) material.normalScale.setScalar(1.1);
    if (kind === "skin") skin(material, ...(await this.creases(about.wrinkles)));
    if (kind === "eyes") eyes(material);
    if (INSIDE.includes(kind)) change(material, "inside", [["#include <lights_fragment_maps>", DULL_ROOM]]);
    if (kind !== "hair" && kind !== "lashes") return [material];
    material.alphaMap = await use("alpha", NoColorSpace);
    const bare = !material.alphaMap && !about.cut;
    const card = (one) => change(one, `card ${bare}`, [OUTWARD, bare ? HAIRS : FINE]);
    if (bare) material.defines.USE_UV = "";
    card(material);
    material.alphaTest = 0.85;
    const soft = material.clone();
    card(soft);
    Object.assign(soft, { alphaTest: 0.02, transparent: true, depthWrite: false });
    return [material, soft];
  }

  async creases(about) {
    if (!about) return [null, []];
    const wrinkles = new Wrinkles(about, await this.texture(about.masks, NoColorSpace));
    this.wrinkles.push(wrinkles);
    const sets = await Promise.all(Object.entries(about.sets).map(async ([number, picture]) => [
      Number(number), about.offsets.includes(Number(number)), await this.texture(picture, NoColorSpace),
    ]));
    return [wrinkles, sets];
  }
}
