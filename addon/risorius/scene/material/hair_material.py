# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the material of hair cards.

The opacity comes from the picture; the soft highlight fades at grazing angles."""

from __future__ import annotations

from ..base.blender_types import Socket
from .look import Look
from .nodes import Graph

_ROUGH = 0.5
_SHINE = 0.12  # metallic: hair reflects in its own colour, also at grazing angles
_GLOSS, _GLOSS_FACING = 0.08, 0.22
_BARE = (0.06, 0.045, 0.035)  # linear colour without a picture


def build(graph: Graph, look: Look) -> None:
    """Build the node tree of the material of scalp hair, brows or a beard.

    Args:
        graph: Graph of the material.
        look: Look of the mesh.
    """
    picture = look.image("color")
    if picture is None:
        graph.set(Base_Color=_BARE, Roughness=0.6, Specular_Ior_Level=0.2)
        return
    node = graph.image(picture, label="Colour")
    graph.set(Base_Color=node.outputs["Color"], Roughness=_ROUGH)
    graph.set(Metallic=_SHINE, Specular_Ior_Level=_GLOSS)
    if picture.channels == 4:
        graph.set(Alpha=node.outputs["Alpha"])
        see_through(graph)
    if look.simple:
        return
    normal = outward_normal(graph)
    # A flat card would reflect everything at a grazing angle; a tuft of fibres does not.
    facing = graph.node("LayerWeight")
    graph.put(normal, facing.inputs["Normal"])
    towards = graph.math("SUBTRACT", 1.0, facing.outputs["Facing"], clamp=True)
    level = graph.math("MULTIPLY", graph.math("POWER", towards, 1.5), _GLOSS_FACING)
    graph.set(Normal=normal, Specular_Ior_Level=level)


def outward_normal(graph: Graph) -> Socket:
    """The normal from the DNA file, for both sides of a card; it is the normal of the skin below.

    Renderers flip normals on the back of a polygon, so the flip is undone.
    """
    geometry = graph.node("NewGeometry")
    both = graph.math("MULTIPLY_ADD", geometry.outputs["Backfacing"], -2.0, 1.0)
    scaled = graph.node("VectorMath")
    scaled.operation = "SCALE"
    graph.put(geometry.outputs["Normal"], scaled.inputs[0])
    graph.put(both, scaled.inputs["Scale"])
    return scaled.outputs[0]


def see_through(graph: Graph) -> None:
    """Make the parts of the cards without hair transparent; EEVEE dithers the transparency."""
    material = graph.material
    material.surface_render_method = "DITHERED"
    material.use_transparency_overlap = False
    if hasattr(material, "use_transparent_shadow"):
        material.use_transparent_shadow = True
