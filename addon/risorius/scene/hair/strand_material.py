# SPDX-License-Identifier: GPL-3.0-or-later
"""What strands of hair look like."""

from __future__ import annotations

from typing import Any

import bpy

from ..base import compat
from ..base.blender_types import MeshObject, NodeTree, Socket

PLACE = "strand_uv"  # attribute of the curves: where in the picture their colour is
_DEEPER = 1.6  # exponent of the colour of fibres that lie close


def material_of(item: MeshObject, dense: bool) -> bpy.types.Material:
    """What strands look like: the picture's colours, where they are dense on fibres that let light
    through.

    Args:
        item: the cards.
        dense: whether light goes from fibre to fibre.
    """
    cards_look = item.data.materials[0] if item.data.materials else None
    material = bpy.data.materials.new(f"{item.name}_strands")
    compat.make_node_tree(material)
    tree = compat.tree_of(material)
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 0.5
    shader.inputs["Specular IOR Level"].default_value = 0.2  # more makes brows grey
    source: Any = cards_look.node_tree if cards_look is not None else None
    pictures = [n for n in source.nodes if n.type == "TEX_IMAGE" and n.image] if source else []
    colour = None
    if pictures:
        spot = tree.nodes.new("ShaderNodeAttribute")
        spot.attribute_name = PLACE
        image: Any = tree.nodes.new("ShaderNodeTexImage")
        image.image = pictures[0].image
        # Strands lie between the picture's hairs too, where other modes have no colour.
        image.image.alpha_mode = "CHANNEL_PACKED"
        tree.links.new(spot.outputs["Vector"], image.inputs["Vector"])
        colour = image.outputs["Color"]
        tree.links.new(colour, shader.inputs["Base Color"])
    if dense:
        _add_fibre(tree, colour)
    return material


def _add_fibre(tree: NodeTree, colour: Socket | None) -> None:
    """Fibres for Cycles beside the surface that EEVEE shows.

    Args:
        tree: of a material.
        colour: of the picture.
    """
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    fibre = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    if hasattr(fibre, "model"):
        fibre.model = "CHIANG"
    fibre.parametrization = "COLOR"
    fibre.inputs["Roughness"].default_value = 0.55
    fibre.inputs["IOR"].default_value = 1.3  # oiled: with 1.55 light from behind makes it grey
    if colour is not None:
        # Light goes through several fibres: what the picture shows is what they give together.
        deep = tree.nodes.new("ShaderNodeGamma")
        deep.inputs["Gamma"].default_value = _DEEPER
        tree.links.new(colour, deep.inputs["Color"])
        tree.links.new(deep.outputs["Color"], fibre.inputs["Color"])
    cycles = tree.nodes.new("ShaderNodeOutputMaterial")
    cycles.target, output.target = "CYCLES", "EEVEE"
    tree.links.new(fibre.outputs[0], cycles.inputs["Surface"])
