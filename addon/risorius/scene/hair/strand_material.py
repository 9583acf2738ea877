# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the material of hair strands, with the colours of the cards that they replace."""

from __future__ import annotations

from typing import Any

import bpy

from ..base import compat
from ..base.blender_types import MeshObject, NodeTree, Socket

PLACE = "strand_uv"  # attribute of the curves: UV coordinates of their colour in the picture
_DEEPER = 1.6  # exponent that darkens the colour of the fibres of dense hair
_FAINTER = 0.75  # exponent that lightens single hairs over skin; dark ones would look like wires


def material_of(item: MeshObject, dense: bool) -> bpy.types.Material:
    """Creates a material of strands with the colours of the cards' picture.

    Args:
        item: mesh of the cards.
        dense: True adds a hair shader for Cycles, in which light passes from fibre to fibre.
    """
    cards_look = item.data.materials[0] if item.data.materials else None
    material = bpy.data.materials.new(f"{item.name}_strands")
    compat.make_node_tree(material)
    tree = compat.tree_of(material)
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 0.5
    shader.inputs["Specular IOR Level"].default_value = 0.2  # a higher level makes brows grey
    source: Any = cards_look.node_tree if cards_look is not None else None
    pictures = [n for n in source.nodes if n.type == "TEX_IMAGE" and n.image] if source else []
    colour = None
    if pictures:
        spot = tree.nodes.new("ShaderNodeAttribute")
        spot.attribute_name = PLACE
        image: Any = tree.nodes.new("ShaderNodeTexImage")
        image.image = pictures[0].image
        # Strands also cover transparent pixels, which have no colour in other alpha modes.
        image.image.alpha_mode = "CHANNEL_PACKED"
        tree.links.new(spot.outputs["Vector"], image.inputs["Vector"])
        colour = image.outputs["Color"]
        seen = colour if dense else _raised(tree, colour, _FAINTER)
        tree.links.new(seen, shader.inputs["Base Color"])
    if dense:
        _add_fibre(tree, colour)
    return material


def _raised(tree: NodeTree, colour: Socket, exponent: float) -> Socket:
    """A colour to the power of an exponent.

    An exponent below 1 makes the colour lighter; dark colours change most.
    """
    node = tree.nodes.new("ShaderNodeGamma")
    node.inputs["Gamma"].default_value = exponent
    tree.links.new(colour, node.inputs["Color"])
    return node.outputs["Color"]


def _add_fibre(tree: NodeTree, colour: Socket | None) -> None:
    """Add a hair shader for Cycles; the existing surface shader remains for EEVEE.

    Args:
        tree: node tree of the material.
        colour: colour of the picture, or None if the cards have no picture.
    """
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    fibre = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    if hasattr(fibre, "model"):
        fibre.model = "CHIANG"
    fibre.parametrization = "COLOR"
    fibre.inputs["Roughness"].default_value = 0.55
    # 1.3 is a value for oiled hair. With Blender's default 1.55, light from behind would make the
    # hair grey.
    fibre.inputs["IOR"].default_value = 1.3
    if colour is not None:
        # The image shows the light of many fibres together, so a single fibre gets a darker colour.
        tree.links.new(_raised(tree, colour, _DEEPER), fibre.inputs["Color"])
    cycles = tree.nodes.new("ShaderNodeOutputMaterial")
    cycles.target, output.target = "CYCLES", "EEVEE"
    tree.links.new(fibre.outputs[0], cycles.inputs["Surface"])
