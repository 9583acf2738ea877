# SPDX-License-Identifier: GPL-3.0-or-later
"""One material per kind of mesh; animated maps as driven inputs of its nodes."""

from pathlib import Path

import bpy

from . import parts
from .meshes import plain_driver

# Diffuse colour, roughness, specular level, subsurface weight: linear values from the look of
# the thing, used where the file brings no texture.
_LOOKS = {
    "skin": ((0.62, 0.36, 0.27, 1.0), 0.5, 0.35, 0.12),
    "eyes": ((0.75, 0.70, 0.66, 1.0), 0.06, 0.6, 0.02),
    "teeth": ((0.72, 0.66, 0.55, 1.0), 0.25, 0.5, 0.1),
    "tongue": ((0.45, 0.12, 0.11, 1.0), 0.35, 0.5, 0.15),
    "gum": ((0.50, 0.17, 0.15, 1.0), 0.3, 0.5, 0.15),
    "lashes": ((0.012, 0.008, 0.006, 1.0), 0.6, 0.2, 0.0),
    "wet": ((1.0, 1.0, 1.0, 1.0), 0.05, 0.5, 0.0),
}
_MAP_PREFIX = "risorius_map_"
_FRAME = "Animated maps"


def build_materials(plan, rig, made, folder=None):
    """Build the materials of a character, one per mesh base.

    Args:
        plan: the CharacterPlan.
        rig: the deforming armature, whose `maps` array drives the map values.
        made: list that every new datablock is put on.
        folder: where the textures named by the metadata lie; None leaves them out.

    Returns:
        Mesh base -> material, and a list of sentences about textures that were not found.
    """
    loader = _Images(folder, made)
    materials = {}
    for mesh in plan.meshes:
        if mesh.base not in materials:
            materials[mesh.base] = _build(plan, mesh, rig, made, loader)
    return materials, loader.missing


class _Images:
    """Loads each image file once and packs it into the .blend."""

    def __init__(self, folder, made):
        self.folder, self.made = folder, made
        self.missing = []
        self._loaded = {}

    def load(self, name, data=False):
        """The image of a file name, or None where there is none."""
        if self.folder is None or not name:
            return None
        path = Path(self.folder) / name
        if path.name != name or not path.is_file():
            sentence = f"The texture {name} was not found beside the file."
            if sentence not in self.missing:
                self.missing.append(sentence)
            return None
        if name not in self._loaded:
            image = bpy.data.images.load(str(path), check_existing=False)
            self.made.append(image)
            if data:
                image.colorspace_settings.is_data = True
            image.pack()
            self._loaded[name] = image
        return self._loaded[name]


def _build(plan, mesh, rig, made, images):
    material = bpy.data.materials.new(f"{plan.name}_{mesh.base}")
    made.append(material)
    color, roughness, specular, subsurface = _LOOKS[mesh.kind]
    material.diffuse_color = color
    if material.node_tree is None:  # 5.0 always has one and warns about the switch
        material.use_nodes = True
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    inputs = shader.inputs
    inputs["Base Color"].default_value = color
    inputs["Roughness"].default_value = roughness
    inputs["Specular IOR Level"].default_value = specular
    inputs["Subsurface Weight"].default_value = subsurface
    inputs["Subsurface Radius"].default_value = (1.0, 0.3, 0.16)
    inputs["Subsurface Scale"].default_value = plan.size * 0.03
    image = images.load(plan.textures.get((mesh.base, "color")))
    if image is not None:
        socket = _image_node(tree, image, (-900, 300))
    else:
        socket = _procedural(tree, mesh, color)
    if mesh.kind == "skin" and plan.map_labels:
        socket = _add_maps(tree, plan, mesh, rig, socket, color, images)
    if socket is not None:
        tree.links.new(socket, inputs["Base Color"])
    alpha = images.load(plan.textures.get((mesh.base, "alpha")), data=True)
    if alpha is not None:
        tree.links.new(_image_node(tree, alpha, (-900, -500)), inputs["Alpha"])
    _finish(material, tree, shader, mesh, image)
    return material


def _image_node(tree, image, location):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    node.location = location
    return node.outputs["Color"]


def _procedural(tree, mesh, color):
    """A colour where no texture is: blotches on skin, an iris in eyes; None leaves it plain."""
    if mesh.kind == "skin":
        noise = tree.nodes.new("ShaderNodeTexNoise")
        noise.inputs["Scale"].default_value = 9.0
        noise.inputs["Detail"].default_value = 6.0
        noise.location = (-1100, 300)
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        coordinates.location = (-1300, 300)
        tree.links.new(coordinates.outputs["Generated"], noise.inputs["Vector"])
        dark = tuple(c * s for c, s in zip(color[:3], (0.86, 0.74, 0.72), strict=True))
        return _ramp(tree, noise.outputs["Fac"], [(0.35, (*dark, 1.0)), (0.65, color)])
    if mesh.kind == "eyes":
        distance = tree.nodes.new("ShaderNodeAttribute")
        distance.attribute_name = "iris"
        distance.location = (-1100, 300)
        stops = [
            (0.0, (0.002, 0.002, 0.002, 1.0)),
            (0.15, (0.002, 0.002, 0.002, 1.0)),
            (0.18, (0.10, 0.055, 0.03, 1.0)),
            (0.40, (0.16, 0.09, 0.05, 1.0)),
            (0.46, (0.03, 0.02, 0.018, 1.0)),
            (0.52, color),
        ]
        return _ramp(tree, distance.outputs["Fac"], stops)
    return None


def _ramp(tree, socket, stops):
    node = tree.nodes.new("ShaderNodeValToRGB")
    node.location = (-800, 300)
    elements = node.color_ramp.elements
    while len(elements) < len(stops):
        elements.new(1.0)
    for element, (position, color) in zip(elements, stops, strict=True):
        element.position, element.color = position, color
    tree.links.new(socket, node.inputs["Fac"])
    return node.outputs["Color"]


def _add_maps(tree, plan, mesh, rig, socket, color, images):
    """A driven value node per animated map; those with a mask tint the colour.

    Returns:
        The colour socket after all tints.
    """
    frame = tree.nodes.new("NodeFrame")
    frame.label = frame.name = _FRAME
    x = -500
    for index, label in enumerate(plan.map_labels):
        value = tree.nodes.new("ShaderNodeValue")
        value.name, value.label = f"{_MAP_PREFIX}{index:03d}", label
        value.parent = frame
        value.location = (-1100 + 180 * (index % 8), -300 - 110 * (index // 8))
        path = f'nodes["{value.name}"].outputs[0].default_value'
        plain_driver(tree.driver_add(path), rig, f'["{parts.MAPS}"][{index}]')
        mask = images.load(plan.textures.get((mesh.base, f"map:{label}")), data=True)
        if mask is None:
            continue
        if socket is None:
            plain = tree.nodes.new("ShaderNodeRGB")
            plain.outputs[0].default_value = color
            socket = plain.outputs[0]
        factor = tree.nodes.new("ShaderNodeMath")
        factor.operation = "MULTIPLY"
        factor.location = (x, -60)
        tree.links.new(_image_node(tree, mask, (x - 300, -60)), factor.inputs[0])
        tree.links.new(value.outputs[0], factor.inputs[1])
        socket = _tint(tree, socket, factor.outputs[0], x + 180)
        x += 260
    return socket


def _tint(tree, socket, factor, x):
    """Redden a colour by a factor: what blood under the skin does."""
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    mix.location = (x, 300)
    tree.links.new(factor, mix.inputs[0])
    tree.links.new(socket, mix.inputs[6])
    mix.inputs[7].default_value = (1.0, 0.42, 0.38, 1.0)
    return mix.outputs[2]


def _finish(material, tree, shader, mesh, image):
    """What only one kind has: the eye's clear coat, transparency of lashes and wet films."""
    inputs = shader.inputs
    if mesh.kind in ("eyes", "teeth", "tongue"):
        inputs["Coat Weight"].default_value = 1.0 if mesh.kind == "eyes" else 0.4
        inputs["Coat Roughness"].default_value = 0.03 if mesh.kind == "eyes" else 0.12
    if mesh.kind == "lashes":
        if not inputs["Alpha"].is_linked and image is not None and image.channels == 4:
            node = next(n for n in tree.nodes if n.type == "TEX_IMAGE" and n.image == image)
            tree.links.new(node.outputs["Alpha"], inputs["Alpha"])
        _surface(material)
    elif mesh.kind == "wet":
        inputs["Alpha"].default_value = 0.04
        inputs["Coat Weight"].default_value = 1.0
        _surface(material)


def _surface(material):
    """Let EEVEE blend it: the property was renamed in 4.2 and the old one left with 5.0."""
    if hasattr(material, "surface_render_method"):
        material.surface_render_method = "DITHERED"


def map_drivers(material):
    """The driver curves of the animated maps of a material, with their map index."""
    data = material.node_tree.animation_data if material and material.node_tree else None
    for curve in data.drivers if data else ():
        if _MAP_PREFIX in curve.data_path:
            yield curve
