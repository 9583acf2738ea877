# SPDX-License-Identifier: GPL-3.0-or-later
"""Short methods for building node trees that work in all supported versions of Blender."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base import compat
from ..base.blender_types import Node, Socket

Color = tuple[float, ...]  # red, green, blue
Value = Socket | float | tuple[float, ...]  # an output to link, or a value to set


class Graph:
    """The node tree of one material.

    Sockets and plain numbers are both allowed as inputs. Sockets are found by number or
    identifier if their names differ between versions.
    """

    def __init__(self, material: bpy.types.Material) -> None:
        compat.make_node_tree(material)
        self.material: bpy.types.Material = material
        self.tree = compat.tree_of(material)
        self.shader = next(n for n in self.tree.nodes if n.type == "BSDF_PRINCIPLED")
        self.output = next(n for n in self.tree.nodes if n.type == "OUTPUT_MATERIAL")

    def node(self, kind: str, label: str = "") -> Node:
        """A new node.

        Args:
            kind: type of the node without the prefix `ShaderNode`.
            label: title of the node; "" for Blender's title of the type.
        """
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        node.label = label
        return node

    def put(self, value: Value | None, socket: Socket) -> None:
        """Link an output socket to an input, or set the input to a value; None changes nothing."""
        if value is None:
            return
        if hasattr(value, "is_output"):
            self.tree.links.new(value, socket)
        elif isinstance(value, tuple) and len(value) == 3 and socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def set(self, **values: Value | None) -> None:
        """Set inputs of the Principled shader.

        The keywords are the names of the inputs with `_` instead of spaces.
        """
        for name, value in values.items():
            self.put(value, self.shader.inputs[name.replace("_", " ").replace("Ior", "IOR")])

    def math(self, operation: str, *values: Value, clamp: bool = False) -> Socket:
        """Add a Math node, and return its output socket.

        Args:
            operation: operation of Blender's Math node, such as "ADD".
            values: numbers or sockets for its inputs, in their order.
            clamp: clamp the result to 0..1.
        """
        node = self.node("Math")
        node.operation, node.use_clamp = operation, clamp
        for value, socket in zip(values, node.inputs, strict=False):
            self.put(value, socket)
        return node.outputs[0]

    def total(self, values: Sequence[Value], clamp: bool = False) -> Value:
        """The sum of numbers or sockets; 0 for none.

        Args:
            values: numbers or sockets to add.
            clamp: clamp the sum to 0..1.
        """
        result = values[0] if values else 0.0
        for value in values[1:]:
            result = self.math("ADD", result, value)
        return self.math("ADD", result, 0.0, clamp=True) if clamp and values else result

    def vector(self, operation: str, *values: Value) -> Socket:
        """Add a Vector Math node, and return its output socket.

        The output is a number for LENGTH, DISTANCE and DOT_PRODUCT, a vector for other operations.

        Args:
            operation: operation of Blender's Vector Math node, such as "ADD".
            values: numbers, vectors or sockets for its inputs, in their order.
        """
        node = self.node("VectorMath")
        node.operation = operation
        for value, socket in zip(values, node.inputs, strict=False):
            self.put(value, socket)
        return node.outputs[1 if operation in ("LENGTH", "DISTANCE", "DOT_PRODUCT") else 0]

    def mix(self, factor: Value, a: Value, b: Value, blend: str = "MIX") -> Socket:
        """Mix two colours.

        Args:
            factor: 0 gives a, 1 gives b; clamped to 0..1.
            a: colour or socket.
            b: colour or socket.
            blend: blend mode of Blender's Mix node, such as "MIX" or "MULTIPLY".
        """
        node = self.node("Mix")
        node.data_type, node.blend_type = "RGBA", blend
        node.clamp_factor = True
        self._mix_inputs(node, factor, a, b, "Color")
        return next(s for s in node.outputs if s.identifier == "Result_Color")

    def mix_number(self, factor: Value, a: Value, b: Value) -> Socket:
        """Mix two numbers.

        Args:
            factor: 0 gives a, 1 gives b; clamped to 0..1.
            a: number or socket.
            b: number or socket.
        """
        node = self.node("Mix")
        node.data_type = "FLOAT"
        self._mix_inputs(node, factor, a, b, "Float")
        return next(s for s in node.outputs if s.identifier == "Result_Float")

    def _mix_inputs(self, node: Node, factor: Value, a: Value, b: Value, kind: str) -> None:
        where = {s.identifier: s for s in node.inputs}
        self.put(factor, where["Factor_Float"])
        self.put(a, where[f"A_{kind}"])
        self.put(b, where[f"B_{kind}"])

    def ramp(self, factor: Value, *stops: tuple[float, Color]) -> Socket:
        """Add a colour ramp node, and return its colour output.

        Args:
            factor: position on the ramp, 0 to 1.
            stops: (position, (r, g, b)) in rising order, linear colours; two at least.
        """
        node = self.node("ValToRGB")
        elements = node.color_ramp.elements
        while len(elements) < len(stops):
            elements.new(1.0)
        for element, (position, color) in zip(elements, stops, strict=True):
            element.position, element.color = position, (*color, 1.0)
        self.put(factor, node.inputs["Fac"] if "Fac" in node.inputs else node.inputs[0])
        return node.outputs[0]

    def noise(
        self, vector: Value, scale: float, detail: float = 2.0, roughness: float = 0.5
    ) -> Socket:
        """Noise from 0 to 1, its mean near 0.5.

        Args:
            vector: coordinates.
            scale: cells of noise for each unit of vector.
            detail: number of octaves.
            roughness: amplitude of each octave, divided by the amplitude of the octave before.
        """
        node = self.node("TexNoise")
        self.put(vector, node.inputs["Vector"])
        node.inputs["Scale"].default_value = scale
        node.inputs["Detail"].default_value = detail
        node.inputs["Roughness"].default_value = roughness
        return node.outputs[0]

    def cells(self, vector: Value, scale: float, feature: str = "F1") -> Socket:
        """The distance output of a Voronoi texture.

        Args:
            vector: coordinates.
            scale: cells for each unit of vector.
            feature: feature of Blender's Voronoi node, such as "F1", the distance to the nearest
                point.
        """
        node = self.node("TexVoronoi")
        node.feature = feature
        self.put(vector, node.inputs["Vector"])
        node.inputs["Scale"].default_value = scale
        return node.outputs["Distance"]

    def attribute(self, name: str) -> Socket:
        """The vector of a mesh attribute; zero on meshes without the attribute."""
        node = self.node("Attribute", name)
        node.attribute_name = name
        return node.outputs["Vector"]

    def attribute_number(self, name: str) -> Socket:
        """The number of a mesh attribute; 0 on meshes without the attribute."""
        node = self.node("Attribute", name)
        node.attribute_name = name
        return node.outputs["Fac"]

    def split(self, vector: Value) -> tuple[Socket, Socket, Socket]:
        """X, y and z of a vector."""
        node = self.node("SeparateXYZ")
        self.put(vector, node.inputs[0])
        return tuple(node.outputs[:3])

    def split_color(self, color: Value) -> tuple[Socket, Socket, Socket]:
        """Red, green and blue of a colour."""
        node = self.node("SeparateColor")
        self.put(color, node.inputs[0])
        return tuple(node.outputs[:3])

    def rest_points(self, size: NDArray[np.float64]) -> Socket:
        """Coordinates on the undeformed mesh, in Blender units from a corner of its bounding box.

        Patterns at these coordinates move with the skin.

        Args:
            size: float64[3], extent of the mesh in Blender units.
        """
        generated = self.node("TexCoord").outputs["Generated"]
        return self.vector("MULTIPLY", generated, tuple(float(s) for s in size))

    def uv(self) -> Socket:
        """The UV map's coordinates."""
        return self.node("TexCoord").outputs["UV"]

    def image(
        self,
        image: bpy.types.Image | None,
        vector: Value | None = None,
        label: str = "",
        clamp: bool = False,
    ) -> Node:
        """An image texture node.

        Args:
            image: the image.
            vector: coordinates; None for the UV map.
            label: title of the node.
            clamp: extend the edge instead of repeating the image.
        """
        node = self.node("TexImage", label)
        node.image = image
        if clamp:
            node.extension = "EXTEND"  # otherwise filtering mixes the opposite edge in
        self.put(vector, node.inputs["Vector"])
        return node

    def bump(
        self, height: Value, distance: float, normal: Value | None = None, strength: float = 1.0
    ) -> Socket:
        """A normal that is computed from a height field.

        Args:
            height: 0 to 1.
            distance: height of the relief in Blender units where `height` is 1.
            normal: normal without the relief; None for the surface's own.
            strength: 0 to 1.
        """
        node = self.node("Bump")
        node.inputs["Strength"].default_value = strength
        node.inputs["Distance"].default_value = distance
        self.put(height, node.inputs["Height"])
        self.put(normal, node.inputs["Normal"])
        return node.outputs["Normal"]

    def tidy(self) -> None:
        """Arrange the nodes in columns: a node's column is the largest number of links on a path
        from the node to the output node.
        """
        sources = defaultdict(list)  # collected once, because socket.links searches the whole tree
        for link in self.tree.links:
            sources[link.to_node].append(link.from_node)
        column = {}
        for node in reversed(self._sources_first(sources)):
            place = column.setdefault(node, 0)
            for source in sources[node]:
                column[source] = max(column.get(source, 0), place + 1)
        rows = {}
        for node in self.tree.nodes:
            place = column.get(node, 1)
            node.location = (400 - 240 * place, 300 - 220 * rows.get(place, 0))
            rows[place] = rows.get(place, 0) + 1

    def _sources_first(self, sources: Mapping[Node, list[Node]]) -> list[Node]:
        """The nodes that feed the output node, sorted: a node comes after all nodes that feed it.

        Args:
            sources: node -> the nodes that are linked to its inputs.
        """
        order, seen, stack = [], {self.output}, [(self.output, iter(sources[self.output]))]
        while stack:
            node, rest = stack[-1]
            source = next((s for s in rest if s not in seen), None)
            if source is None:
                order.append(node)
                stack.pop()
            else:
                seen.add(source)
                stack.append((source, iter(sources[source])))
        return order
