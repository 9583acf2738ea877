# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the materials of eyes, teeth, tongue, gums, lashes and wet films.

Textures are optional, because procedural nodes can give each surface its details."""

from __future__ import annotations

import bpy

from ..base.blender_types import Socket
from .look import Look
from .nodes import Color, Graph, Value

# Mesh attributes of each vertex. EYES: x and height relative to the eye's axis, in eye radii, and
# 1 on the front half, else 0. TEETH: position along the arch, pi per tooth, and height, -1 to 1.
# MOUTH: depth behind the foremost vertex, divided by the distance between the eyes.
EYES = "risorius_eye"
TEETH = "risorius_teeth"
MOUTH = "risorius_mouth"

# Linear RGB colours, tuned by hand in renders.
_SCLERA, _SCLERA_RIM, _VEIN = (0.72, 0.66, 0.62), (0.56, 0.39, 0.34), (0.48, 0.14, 0.11)
_PUPIL, _IRIS_IN, _IRIS_OUT = (0.002, 0.002, 0.002), (0.19, 0.10, 0.045), (0.055, 0.066, 0.05)
_LIMBUS = (0.022, 0.022, 0.02)
_ENAMEL, _ENAMEL_ROOT, _GAP = (0.74, 0.66, 0.53), (0.62, 0.47, 0.29), (0.26, 0.15, 0.09)
_GUM, _GUM_DARK = (0.44, 0.14, 0.12), (0.28, 0.065, 0.06)
_TONGUE, _TONGUE_DARK = (0.45, 0.15, 0.14), (0.30, 0.065, 0.065)
_CARUNCLE, _CARUNCLE_DARK = (0.58, 0.27, 0.23), (0.44, 0.15, 0.13)
_LASH, _LASH_TIP = (0.010, 0.006, 0.004), (0.045, 0.026, 0.016)
# Depth in the mouth, divided by the distance between the eyes, and colour by which the surface is
# multiplied at this depth. The colour imitates the shadows of lips and cheeks: in Material Preview
# and exports, which have no cast shadows, molars would otherwise be as bright as incisors.
_SHADED = (
    (0.12, (1.0,) * 3),
    (0.24, (0.77, 0.75, 0.73)),
    (0.35, (0.46, 0.42, 0.39)),
    (0.62, (0.18, 0.13, 0.11)),
)
_CORNEA_IOR = 1.376
_COARSE = 1500  # vertices: a mesh with fewer has no separate teeth, so the material draws them


def build(graph: Graph, look: Look) -> None:
    """Build the node tree of a material by the kind of its mesh.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    _KINDS[look.kind](graph, look)


def _textured_normal(graph: Graph, look: Look) -> Socket | None:
    image = look.image("normal", data=True)
    if image is None:
        return None
    node = graph.node("NormalMap")
    graph.put(graph.image(image, label="Normal").outputs["Color"], node.inputs["Color"])
    return node.outputs["Normal"]


def eyes(graph: Graph, look: Look) -> None:
    """Build the material of eyes: sclera with veins, hollow iris and pupil.

    With a separate cornea mesh and a colour texture, the iris is dry and only the sclera is wet.
    Otherwise the clear coat over all three is the cornea. The coat keeps the smooth normal of the
    eyeball, so that the highlight is round. The hollow iris is lit on the side away from the light,
    as refraction lights a real iris.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    if look.cornea and look.image("color") is not None:
        _ball(graph, look)
        return
    x, z, front = graph.split(graph.attribute(EYES))
    flat = graph.node("CombineXYZ")
    for value, socket in zip((x, z), flat.inputs, strict=False):
        graph.put(value, socket)
    radius = graph.vector("LENGTH", flat.outputs[0])
    behind = graph.math("SUBTRACT", 1.0, front)
    away = graph.math("ADD", radius, graph.math("MULTIPLY", behind, 2.0))
    picture = look.image("color")
    if picture is not None:
        color = graph.image(picture, label="Colour").outputs["Color"]
    else:
        color = _iris_and_sclera(graph, look, flat.outputs[0], away)
    hollow = graph.ramp(away, (0.0, (0.0, 0.0, 0.0)), (0.46, (1.0, 1.0, 1.0)))
    bumpy = graph.noise(graph.rest_points(look.extent), 26.0 / look.unit, detail=3.0)
    height = graph.math("MULTIPLY_ADD", bumpy, 0.06, hollow)
    rough = graph.ramp(away, (0.42, (0.45, 0.45, 0.45)), (0.56, (0.16, 0.16, 0.16)))
    graph.set(Base_Color=color, Roughness=rough, Specular_Ior_Level=0.4)
    graph.set(Coat_Weight=1.0, Coat_Roughness=_film(graph, look, 0.01, 0.04), Coat_Ior=1.5)
    if not look.simple:
        relief = graph.bump(height, look.unit * 0.045, _textured_normal(graph, look), 0.55)
        graph.set(Normal=relief, Subsurface_Weight=0.25, Subsurface_Scale=look.unit * 0.02)
        graph.set(Subsurface_Radius=(1.0, 0.55, 0.4))


def _ball(graph: Graph, look: Look) -> None:
    """Build the material of eyeballs under a separate cornea mesh: dry iris and wet sclera.

    Args:
        graph: Graph of the material.
        look: Look of the mesh, with a colour texture.
    """
    x, z, front = graph.split(graph.attribute(EYES))
    flat = graph.math("SQRT", graph.math("MULTIPLY_ADD", x, x, graph.math("MULTIPLY", z, z)))
    away = graph.math("MULTIPLY_ADD", graph.math("SUBTRACT", 1.0, front), 2.0, flat)
    outside = graph.ramp(away, (0.40, (0.0,) * 3), (0.45, (1.0,) * 3))
    color = graph.image(look.image("color"), label="Colour").outputs["Color"]
    graph.set(Base_Color=color, Specular_Ior_Level=0.3)
    graph.set(Roughness=graph.ramp(away, (0.40, (0.6,) * 3), (0.45, (0.32,) * 3)))
    graph.set(Coat_Weight=outside, Coat_Roughness=_film(graph, look, 0.03, 0.09), Coat_Ior=1.38)
    if not look.simple:
        bumpy = graph.noise(graph.rest_points(look.extent), 34.0 / look.unit, detail=3.0)
        fibres = graph.math("MULTIPLY", graph.split_color(color)[1], 3.0)
        height = graph.mix(outside, _gray(graph, fibres), _gray(graph, bumpy))
        relief = graph.bump(height, look.unit * 0.004, _textured_normal(graph, look), 0.5)
        weight = graph.math("MULTIPLY", outside, 0.3)
        graph.set(Normal=relief, Subsurface_Weight=weight, Subsurface_Scale=look.unit * 0.02)
        graph.set(Subsurface_Radius=(1.0, 0.55, 0.4))


def _iris_and_sclera(graph: Graph, look: Look, flat: Value, away: Value) -> Value:
    turned = graph.vector("NORMALIZE", flat)
    fibres = graph.noise(turned, 9.0, detail=5.0, roughness=0.75)
    iris = graph.mix(
        graph.math("MULTIPLY_ADD", away, 4.0, graph.math("MULTIPLY_ADD", fibres, 0.6, -0.9)),
        _IRIS_IN,
        _IRIS_OUT,
    )
    dark = graph.math("MULTIPLY", graph.math("POWER", fibres, 2.0), 2.4)
    lines = graph.math("MULTIPLY_ADD", dark, 0.9, 0.35)
    iris = graph.mix(1.0, iris, _gray(graph, lines), blend="MULTIPLY")
    edge = graph.ramp(away, (0.145, (0.0,) * 3), (0.165, (1.0,) * 3))
    iris = graph.mix(edge, _PUPIL, iris)
    rim = graph.ramp(away, (0.37, (0.0,) * 3), (0.455, (1.0,) * 3))
    iris = graph.mix(rim, iris, _LIMBUS)
    white = graph.ramp(away, (0.50, _SCLERA), (1.0, _SCLERA_RIM))
    points = graph.rest_points(look.extent)
    vein = graph.cells(points, 9.0 / look.unit, "DISTANCE_TO_EDGE")
    thin = graph.ramp(vein, (0.0, (0.55,) * 3), (0.05, (0.0,) * 3))
    patchy = graph.noise(points, 5.0 / look.unit)
    amount = graph.math("MULTIPLY", thin, graph.math("MULTIPLY", patchy, away), clamp=True)
    white = graph.mix(amount, white, _VEIN)
    outside = graph.ramp(away, (0.455, (0.0,) * 3), (0.51, (1.0,) * 3))
    return graph.mix(outside, iris, white)


def _gray(graph: Graph, value: Value) -> Socket:
    node = graph.node("CombineColor")
    for socket in node.inputs:
        graph.put(value, socket)
    return node.outputs[0]


def _film(graph: Graph, look: Look, low: float, high: float) -> Socket:
    """Uneven wetness: a roughness that noise varies between two values.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
        low, high: the two values, 0 to 1.
    """
    uneven = graph.noise(graph.rest_points(look.extent), 14.0 / look.unit, detail=3.0)
    return graph.math("MULTIPLY_ADD", uneven, high - low, low)


def teeth(graph: Graph, look: Look) -> None:
    """Build the material of teeth: enamel that gets yellower towards the gum.

    On a coarse mesh without a texture, the nodes also draw single teeth and gums.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    picture = look.image("color")
    points = graph.rest_points(look.extent)
    place, height, _ = graph.split(graph.attribute(TEETH))
    away = graph.math("ABSOLUTE", height)
    normal = _textured_normal(graph, look)
    if picture is not None:
        color = graph.image(picture, label="Colour").outputs["Color"]
    else:
        stain = graph.math("MULTIPLY_ADD", graph.noise(points, 16.0 / look.unit), 0.5, away)
        color = graph.ramp(stain, (0.35, _ENAMEL), (1.0, _ENAMEL_ROOT))
        if look.vertices < _COARSE:
            # |sin| is 0 between two teeth and 1 in the middle of a tooth.
            round_ = graph.math("ABSOLUTE", graph.math("SINE", place))
            gap = graph.ramp(round_, (0.0, (1.0,) * 3), (0.16, (0.0,) * 3))
            color = graph.mix(graph.math("MULTIPLY", gap, 0.8), color, _GAP)
            arch = graph.math("POWER", round_, 0.45)
            scallop = graph.math("MULTIPLY_ADD", arch, -0.17, away)
            gum = graph.ramp(scallop, (0.60, (0.0,) * 3), (0.64, (1.0,) * 3))
            pink = graph.ramp(graph.noise(points, 20.0 / look.unit), (0.3, _GUM_DARK), (0.7, _GUM))
            color = graph.mix(gum, color, pink)
            relief = graph.math("MULTIPLY_ADD", gum, 0.25, arch)
            if not look.simple:
                normal = graph.bump(relief, look.unit * 0.05, normal, 0.8)
    shade = _shade(graph)
    color = graph.mix(1.0, color, shade, "MULTIPLY")
    graph.set(Base_Color=color, Roughness=_film(graph, look, 0.18, 0.42), Coat_Roughness=0.12)
    _shine(graph, shade, coat=0.35, gloss=0.5)
    if not look.simple:
        graph.set(Subsurface_Weight=0.35, Subsurface_Scale=look.unit * 0.02)
        graph.set(Subsurface_Radius=(1.0, 0.8, 0.6), Normal=normal)


def tongue(graph: Graph, look: Look) -> None:
    """Build the material of a tongue: wet flesh with papillae as relief.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    _flesh(graph, look, (_TONGUE_DARK, _TONGUE), 46.0, _shade(graph))


def gum(graph: Graph, look: Look) -> None:
    """Build the material of gums, caruncles and cartilage: wet, mottled flesh.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    in_eye = any(word in look.base.lower() for word in ("cartilage", "caruncle"))
    tones = (_CARUNCLE_DARK, _CARUNCLE) if in_eye else (_GUM_DARK, _GUM)
    _flesh(graph, look, tones, 0.0 if in_eye else 26.0, None if in_eye else _shade(graph))


def _shade(graph: Graph) -> Socket:
    """The colour that darkens a surface by its depth in the mouth: white in front, dark inside."""
    return graph.ramp(graph.attribute_number(MOUTH), *_SHADED)


def _shine(graph: Graph, shade: Socket | None, coat: float, gloss: float) -> None:
    """Set the wet coat of a surface, and the gloss of the surface under the coat.

    Args:
        graph: Graph of the material.
        shade: colour whose red channel scales coat and gloss, so that both are weaker in the dark
            parts of the mouth; None: no scaling.
        coat: weight of the coat, 0 to 1.
        gloss: specular level of the surface.
    """
    if shade is None:
        graph.set(Coat_Weight=coat, Specular_Ior_Level=gloss)
        return
    light, _, _ = graph.split_color(shade)
    graph.set(Coat_Weight=graph.math("MULTIPLY", light, coat))
    graph.set(Specular_Ior_Level=graph.math("MULTIPLY", light, gloss))


def _flesh(
    graph: Graph, look: Look, tones: tuple[Color, Color], grain: float, shade: Socket | None
) -> None:
    points = graph.rest_points(look.extent)
    picture = look.image("color")
    mottled = graph.noise(points, 6.0 / look.unit, detail=5.0, roughness=0.6)
    color = graph.ramp(mottled, (0.3, tones[0]), (0.7, tones[1]))
    if picture is not None:
        color = graph.image(picture, label="Colour").outputs["Color"]
    if shade is not None:
        color = graph.mix(1.0, color, shade, "MULTIPLY")
    graph.set(Base_Color=color, Roughness=_film(graph, look, 0.32, 0.55), Coat_Roughness=0.16)
    _shine(graph, shade, coat=0.5, gloss=0.45)
    if look.simple:
        return
    # Papillae are Voronoi cells; a caruncle has only coarse noise as relief.
    relief = graph.cells(points, grain / look.unit) if grain else mottled
    graph.set(
        Normal=graph.bump(relief, look.unit * 0.012, _textured_normal(graph, look), 0.6),
        Subsurface_Weight=0.8,
        Subsurface_Scale=look.unit * 0.03,
        Subsurface_Radius=(1.0, 0.3, 0.25),
    )


def lashes(graph: Graph, look: Look) -> None:
    """Build the material of lashes: hairs on cards.

    The hairs come from an alpha texture, a colour texture with alpha, or else a noise pattern.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    picture, mask = look.image("color"), look.image("alpha", data=True)
    strands = _strands(graph, look)
    color = graph.ramp(strands, (0.35, _LASH), (0.85, _LASH_TIP))
    alpha = graph.ramp(strands, (0.53, (0.0,) * 3), (0.61, (1.0,) * 3))
    if mask is not None:
        alpha = graph.image(mask, label="Alpha").outputs["Color"]
    elif picture is not None:
        node = graph.image(picture, label="Colour")
        # An image without alpha shows hairs on a plain ground, so the noise pattern is used.
        alpha = node.outputs["Alpha"] if picture.channels == 4 else alpha
        color = node.outputs["Color"] if picture.channels == 4 else color
    graph.set(Base_Color=color, Alpha=alpha, Roughness=_film(graph, look, 0.4, 0.6))
    graph.set(Specular_Ior_Level=0.25)
    _transparent(graph.material, "DITHERED")


def _strands(graph: Graph, look: Look) -> Socket:
    """Noise that is stretched along the hairs: along v of the UV map, or y without a UV map."""
    where = graph.uv() if look.has_uvs else graph.rest_points(look.extent)
    reach = 1.0 if look.has_uvs else 1.0 / look.unit
    stretched = graph.vector("MULTIPLY", where, (110 * reach, 0.6 * reach, 110 * reach))
    return graph.noise(stretched, 4.0, detail=2.0)


def wet(graph: Graph, look: Look) -> None:
    """Build the material of wet films: a clear film that reflects like water at each angle.

    The film is transparent and does not refract, because a refracting shell keeps light from the
    eye under it in both engines. Only a cornea refracts, in Cycles and for camera rays alone, so
    that light and shadows pass.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    points = graph.rest_points(look.extent)
    ripples = graph.noise(points, 18.0 / look.unit, detail=3.0)
    base = look.base.lower()
    cornea = "cornea" in base
    still = cornea or "eyeedge" in base  # ripples would break up its single highlight
    normal = None if still else graph.bump(ripples, look.unit * 0.006, None, 0.25)
    gloss = graph.node("BsdfGlossy")
    gloss.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    rough = (0.008, 0.02) if still else (0.02, 0.10)
    graph.put(_film(graph, look, *rough), gloss.inputs["Roughness"])
    graph.put(normal, gloss.inputs["Normal"])
    fresnel = graph.node("Fresnel")
    fresnel.inputs["IOR"].default_value = _CORNEA_IOR if cornea else 1.336
    graph.put(normal, fresnel.inputs["Normal"])
    # The back of the film must not reflect, because there is no air on that side.
    facing = graph.math("SUBTRACT", 1.0, graph.node("NewGeometry").outputs["Backfacing"])
    amount = graph.math("MULTIPLY", fresnel.outputs[0], facing)
    clear = graph.node("BsdfTransparent")
    if not still:
        tint = graph.ramp(ripples, (0.3, (0.985, 0.975, 0.97)), (0.7, (1.0, 1.0, 1.0)))
        graph.put(tint, clear.inputs["Color"])
    under = _mixed(graph, amount, clear.outputs[0], gloss.outputs[0])
    graph.put(under, graph.output.inputs["Surface"])
    if cornea:
        bent = graph.node("BsdfRefraction")
        bent.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        bent.inputs["Roughness"].default_value = 0.0
        bent.inputs["IOR"].default_value = _CORNEA_IOR
        seen = graph.math("MULTIPLY", graph.node("LightPath").outputs["Is Camera Ray"], facing)
        through = _mixed(graph, seen, clear.outputs[0], bent.outputs[0])
        cycles = graph.node("OutputMaterial")
        cycles.target = "CYCLES"
        graph.put(_mixed(graph, amount, through, gloss.outputs[0]), cycles.inputs["Surface"])
    graph.tree.nodes.remove(graph.shader)
    _transparent(graph.material, "BLENDED")


def _mixed(graph: Graph, amount: Value, one: Socket, other: Socket) -> Socket:
    """A mix of two shaders; an amount of 0 gives `one`, 1 gives `other`."""
    both = graph.node("MixShader")
    graph.put(amount, both.inputs[0])
    graph.put(one, both.inputs[1])
    graph.put(other, both.inputs[2])
    return both.outputs[0]


def _transparent(material: bpy.types.Material, method: str) -> None:
    """Set EEVEE's method of transparency, and let light pass through clear parts in shadows."""
    material.surface_render_method = method  # pyright: ignore[reportAttributeAccessIssue]
    material.use_transparency_overlap = False
    if hasattr(material, "use_transparent_shadow"):
        material.use_transparent_shadow = True


_KINDS = {
    "eyes": eyes,
    "teeth": teeth,
    "tongue": tongue,
    "gum": gum,
    "lashes": lashes,
    "wet": wet,
}
