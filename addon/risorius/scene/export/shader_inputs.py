# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the source of each shader input in a node tree: a number, an image, or nodes to bake.

Animated maps are set to 0, so that an exported file shows the neutral face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..base.blender_types import Node, NodeTree, Socket
from ..material import skin_material

_COLORED = ("BSDF_PRINCIPLED", "BSDF_DIFFUSE", "EMISSION", "SUBSURFACE_SCATTERING", "BSDF_TOON")
_CLEAR = ("BSDF_TRANSPARENT", "BSDF_GLASS", "BSDF_REFRACTION")


@dataclass(frozen=True)
class Source:
    """Source of the values of an input.

    Attributes:
        value: value of an unconnected input, else None.
        node: the image texture node that feeds the input unchanged, or None.
        channel: output of this node: "Color" or "Alpha".
        socket: output socket that feeds the input; None if the input is unconnected.
    """

    value: float | tuple[float, ...] | None = None
    node: Node | None = None
    channel: str = ""
    socket: Socket | None = None

    def is_picture(self) -> bool:
        """Whether the source is the unchanged colour of an image."""
        return self.node is not None and self.channel == "Color"

    def picture(self) -> bpy.types.Image:
        """The image of a source with an image node."""
        assert self.node is not None
        return self.node.image

    def is_alpha_of(self, other: Source) -> bool:
        """Whether the source is the alpha of the image whose colour is the other source."""
        return (
            self.node is not None
            and self.channel == "Alpha"
            and other.is_picture()
            and self.node.image == other.picture()
        )


def rest_maps(tree: NodeTree) -> None:
    """Remove the drivers of a copied node tree, and set its animated maps to 0."""
    tree.animation_data_clear()
    for node in tree.nodes:
        if node.type == "VALUE" and node.name.startswith(skin_material.MAP_PREFIX):
            node.outputs[0].default_value = 0.0


def alike(tree: NodeTree, other: NodeTree) -> bool:
    """Whether two trees give the same result, such as the unedited trees of an eye and its iris.

    Args:
        tree: nodes of a material.
        other: nodes of another material.
    """
    return _told(tree) == _told(other)


def _told(tree: NodeTree) -> tuple[list[tuple[object, ...]], set[tuple[str, str]]]:
    nodes = []
    for node in tree.nodes:
        values = [getattr(s, "default_value", None) for s in (*node.inputs, *node.outputs)]
        plain = [tuple(v) if v is not None and hasattr(v, "__len__") else v for v in values]
        ramp = getattr(node, "color_ramp", None)
        stops = [(e.position, tuple(e.color)) for e in ramp.elements] if ramp else []
        nodes.append((node.name, node.bl_idname, getattr(node, "image", None), plain, stops))
    links = {(x.from_socket.path_from_id(), x.to_socket.path_from_id()) for x in tree.links}
    return nodes, links


def shader_of(tree: NodeTree) -> tuple[Node | None, bool]:
    """Find the shader node that gives a surface its colour.

    Returns:
        The node (None if the surface has no such node, like a transparent film), and whether any
        node is transparent or refractive.
    """
    output = tree.get_output_node("ALL")
    found = _upstream(output.inputs["Surface"]) if output is not None else []
    clear = any(node.type in _CLEAR for node in found)
    for kind in _COLORED:
        for node in found:
            if node.type == kind:
                return node, clear
    return None, clear


def _upstream(socket: Socket) -> list[Node]:
    """The nodes that feed an input, nearest first."""
    found, todo = [], [socket]
    while todo:
        for link in todo.pop(0).links:
            if link.from_node not in found:
                found.append(link.from_node)
                todo.extend(link.from_node.inputs)
    return found


def source(shader: Node, *names: str) -> Source:
    """Find the source of the values of a shader's input.

    Args:
        shader: the shader node.
        names: names of the input in different Blender versions; the first existing one is used.

    Returns:
        The Source. If the shader has none of these inputs, its value, node and socket are None.
    """
    socket = next((shader.inputs[n] for n in names if n in shader.inputs), None)
    if socket is None:
        return Source()
    feeding = _feeding(socket)
    if feeding is None:
        value = socket.default_value
        return Source(value=tuple(value) if socket.type in ("RGBA", "VECTOR") else value)
    node = feeding.node
    if node.type == "TEX_IMAGE" and _plain(node):
        return Source(node=node, channel=feeding.name, socket=feeding)
    return Source(socket=feeding)


def normal_image(shader: Node) -> Node | None:
    """The image node of a shader's normal map, also below Bump nodes. None if there is none, or
    if its image is tiled (UDIM) or mapped otherwise than by the mesh's default UV map."""
    socket = shader.inputs.get("Normal")
    while socket is not None and (feeding := _feeding(socket)) is not None:
        node = feeding.node
        if node.type == "NORMAL_MAP":
            below = _feeding(node.inputs["Color"])
            found = below.node if below is not None else None
            return found if found and found.type == "TEX_IMAGE" and _plain(found) else None
        socket = node.inputs["Normal"] if node.type == "BUMP" else None
    return None


def by_place(socket: Socket) -> bool:
    """Whether the value of an output depends on more than the UV map: on geometry, attributes,
    vertex colours or other texture coordinates.
    """
    for node in [socket.node, *(n for s in socket.node.inputs for n in _upstream(s))]:
        if node.type in ("ATTRIBUTE", "NEW_GEOMETRY", "VERTEX_COLOR"):
            return True
        if node.type == "TEX_COORD" and any(o.is_linked for o in node.outputs if o.name != "UV"):
            return True
    return False


def _plain(node: Node) -> bool:
    """Whether an image texture shows a single image, without UDIM tiles, by the mesh's UV map."""
    image = node.image
    whole = image is not None and image.size[0] > 0 and image.source != "TILED"
    return whole and not node.inputs["Vector"].is_linked and node.projection == "FLAT"


def _feeding(socket: Socket) -> Socket | None:
    """The output connected to an input, skipping mix nodes without effect; or None."""
    while socket.is_linked:
        feeding = socket.links[0].from_socket
        node = feeding.node
        if node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "MIX" and _zero(_enabled(node, "Factor_Float")):
            socket = _enabled(node, f"A_{'Color' if node.data_type == 'RGBA' else 'Float'}")
        else:
            return feeding
    return None


def _enabled(node: Node, identifier: str) -> Socket:
    return next(s for s in node.inputs if s.identifier == identifier)


def _zero(socket: Socket) -> bool:
    """Whether an input is 0 on the whole surface, because the animated maps are 0."""
    if not socket.is_linked:
        return socket.type == "VALUE" and socket.default_value == 0.0
    node = socket.links[0].from_node
    if node.type == "VALUE":
        return node.outputs[0].default_value == 0.0
    if node.type != "MATH":
        return node.type == "MIX" and all(_zero(_enabled(node, n)) for n in ("A_Float", "B_Float"))
    zeros = [_zero(s) for s in node.inputs[:2]]
    return all(zeros) if node.operation == "ADD" else _vanishes(node.operation, zeros, node)


def _vanishes(operation: str, zeros: Sequence[bool], node: Node) -> bool:
    if operation == "MULTIPLY":
        return any(zeros)
    other = node.inputs[1]
    limit = not other.is_linked and other.default_value >= 0.0
    return operation == "MINIMUM" and zeros[0] and limit
