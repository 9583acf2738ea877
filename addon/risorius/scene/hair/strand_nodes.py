# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the geometry nodes that turn hair cards into strands.

A card is a strip of polygons; each of its rows has a left and a right vertex. A lock is a group of
strands of one card that share a root and a direction.
"""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base.blender_types import MeshObject, Node, NodeTree, Socket
from .strand_kinds import Coil, Kind
from .strand_material import PLACE, material_of

TREE = "Risorius Strands"
CARDS = "Cards"  # input of the modifier: the mesh of the cards
_OF_A_TURN = 7  # points per turn of a coil
_MOST_POINTS = 100
_ROOT = 0.2  # fraction of its length over which a strand grows to its full radius
_MOST_SLID = 0.9  # rows that a strand may slide; a longer way would leave a bent card


class _Tree:
    """Short methods that add nodes to a geometry node tree and link them."""

    def __init__(self, tree: NodeTree) -> None:
        self.tree = tree

    def node(
        self, kind: str, inputs: dict[str | int, object] | None = None, **settings: object
    ) -> Node:
        node = self.tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(node, key, value)
        for name, value in (inputs or {}).items():
            self.put(value, node.inputs[name])
        return node

    def put(self, value: object, socket: Socket) -> None:
        if hasattr(value, "is_output"):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation: str, *values: object) -> Socket:
        node = self.node("ShaderNodeMath", operation=operation)
        for value, socket in zip(values, node.inputs, strict=False):
            self.put(value, socket)
        return node.outputs[0]

    def group(self, number: object, size: int) -> Socket:
        """The integer quotient of a number and `size`.

        If numbers form groups of `size` successive numbers, this is the index of a number's group.
        """
        return self.math("FLOOR", self.math("DIVIDE", self.math("ADD", number, 0.5), size))

    def random(self, low: float, high: float, seed: int, number: object) -> Socket:
        """A field of random values from low to high; equal values of `number` give equal values.

        Args:
            low, high: range of the values.
            seed: another seed gives other values.
            number: field of integers.
        """
        node = self.node("FunctionNodeRandomValue", {2: low, 3: high, "ID": number, "Seed": seed})
        return node.outputs[1]

    def taken(self, mesh: object, value: object, index: object, kind: str) -> Socket:
        """Sample a value at one vertex of a mesh.

        Args:
            mesh: the mesh.
            value: the field to sample.
            index: index of the vertex.
            kind: data type of the value, such as "FLOAT_VECTOR".
        """
        node = self.node("GeometryNodeSampleIndex", data_type=kind, domain="POINT")
        self.put(mesh, node.inputs[0])
        self.put(value, next(s for s in node.inputs if s.name == "Value" and s.enabled))
        self.put(index, node.inputs["Index"])
        return next(s for s in node.outputs if s.enabled)

    def between(self, a: object, b: object, share: object) -> Socket:
        """Mix two vectors: share 0 gives `a`, 1 gives `b`, a share outside 0 to 1 extrapolates."""
        node = self.node("ShaderNodeMix", data_type="VECTOR", clamp_factor=False)
        where = {s.identifier: s for s in node.inputs}
        for value, name in ((share, "Factor_Float"), (a, "A_Vector"), (b, "B_Vector")):
            self.put(value, where[name])
        return next(s for s in node.outputs if s.identifier == "Result_Vector")


def strand_tree(item: MeshObject, rows: int, kind: Kind, unit: float) -> NodeTree:
    """Geometry nodes that replace the cards of a mesh with strands.

    Args:
        item: mesh of the cards.
        rows: rows of vertices per card.
        kind: kind of strands.
        unit: metres per Blender unit.
    """
    tree: Any = bpy.data.node_groups.new(TREE, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    g = _Tree(tree)
    tree.interface.new_socket(CARDS, in_out="INPUT", socket_type="NodeSocketObject")
    given = g.node("NodeGroupInput").outputs[CARDS]
    source = g.node("GeometryNodeObjectInfo", {"Object": given}, transform_space="RELATIVE")
    mesh = source.outputs["Geometry"]
    lines = _lines(g, kind.each * len(item.data.vertices) // (2 * rows), rows)
    # Each strand has one point per row, so a point's index gives its strand, card and row.
    index = g.node("GeometryNodeInputIndex").outputs[0]
    strand = g.group(index, rows)
    card = g.group(strand, kind.each)
    row = g.math("SUBTRACT", index, g.math("MULTIPLY", strand, rows))
    left = g.math("MULTIPLY", g.math("ADD", g.math("MULTIPLY", card, rows), row), 2)
    right = g.math("ADD", left, 1)
    # Strands drift a little across their card from root to tip.
    lock = _lock(g, strand, kind)
    across = g.random(0.04 - kind.aside, 0.96 + kind.aside, 1, lock)
    lean = g.random(-0.1, 0.1, 2, lock)
    across = g.math("ADD", across, g.math("MULTIPLY", lean, g.math("DIVIDE", row, rows)))
    place = g.node("GeometryNodeInputPosition").outputs[0]
    ends = [g.taken(mesh, place, i, "FLOAT_VECTOR") for i in (left, right)]
    if kind.along:
        # Points slide along the segment to the next row. The last row has no next row, so its
        # points slide along the segment before it: `back` is 2, the number of vertices in a row.
        back = g.math("MULTIPLY", g.math("GREATER_THAN", row, rows - 1.5), 2)
        most = min(_MOST_SLID, kind.along / unit / (_lengths(item, rows).mean() / (rows - 1)))
        share = g.random(-most, 0.4 * most, 5, lock)
        starts = [g.math("SUBTRACT", i, back) for i in (left, right)]
        ends = [
            _slid(g, mesh, place, end, start, share)
            for end, start in zip(ends, starts, strict=True)
        ]
    aside = _aside(g, lock, kind.apart / unit)
    g.put(g.math("DIVIDE", row, rows - 1), aside.inputs["Scale"])
    moved = g.node(
        "GeometryNodeSetPosition",
        {
            "Geometry": lines.outputs[0],
            "Position": g.between(ends[0], ends[1], across),
            "Offset": aside.outputs[0],
        },
    )
    stored = _store_place(g, item, mesh, moved.outputs[0], (left, right, across))
    finished = _finish(g, stored, _points_of(item, rows, kind, unit), kind, unit)
    painted = g.node(
        "GeometryNodeSetMaterial", {"Geometry": finished, "Material": material_of(item, kind.dense)}
    )
    out = g.node("NodeGroupOutput")
    tree.links.new(painted.outputs[0], out.inputs[0])
    return tree


def _lines(g: _Tree, count: int, rows: int) -> Node:
    """Straight curves with one point per row of a card.

    Args:
        g: the tree.
        count: number of curves.
        rows: rows of vertices per card.
    """
    line = g.node("GeometryNodeCurvePrimitiveLine")
    line = g.node("GeometryNodeResampleCurve", {"Curve": line.outputs[0], "Count": rows})
    dots = g.node("GeometryNodePoints", {"Count": count})
    many = g.node("GeometryNodeInstanceOnPoints", {0: dots.outputs[0], "Instance": line.outputs[0]})
    return g.node("GeometryNodeRealizeInstances", {0: many.outputs[0]})


def _aside(g: _Tree, lock: Socket, most: float) -> Node:
    """A random displacement of each lock, up to `most` Blender units along each axis.

    Returns:
        A node that scales the displacement; the caller connects the input Scale of the node.
    """
    parted = g.node("FunctionNodeRandomValue", {"ID": lock, "Seed": 4}, data_type="FLOAT_VECTOR")
    parted.inputs["Min"].default_value = [-most] * 3
    parted.inputs["Max"].default_value = [most] * 3
    return g.node("ShaderNodeVectorMath", {0: parted.outputs["Value"]}, operation="SCALE")


def _slid(
    g: _Tree, mesh: Socket, place: Socket, end: Socket, start: Socket, share: Socket
) -> Socket:
    """Position of a card's vertex for a strand that is shifted along the card.

    Args:
        g: the tree.
        mesh: the deformed cards.
        place: the field of vertex positions.
        end: position of the vertex without the shift.
        start: index of the vertex where the segment to the next row starts.
        share: length of the shift as a fraction of that segment; negative: towards the root.
    """
    first, second = (
        g.taken(mesh, place, i, "FLOAT_VECTOR") for i in (start, g.math("ADD", start, 2))
    )
    way = g.node("ShaderNodeVectorMath", {0: second, 1: first}, operation="SUBTRACT").outputs[0]
    slide = g.node("ShaderNodeVectorMath", {0: way}, operation="SCALE")
    g.put(share, slide.inputs["Scale"])
    return g.node("ShaderNodeVectorMath", {0: end, 1: slide.outputs[0]}, operation="ADD").outputs[0]


def _store_place(
    g: _Tree, item: MeshObject, mesh: Socket, curves: Socket, where: tuple[Socket, Socket, Socket]
) -> Socket:
    """Store the UV coordinates of each point, in the picture of the cards, on the curves.

    Args:
        g: the tree.
        item: mesh of the cards.
        mesh: the deformed cards.
        curves: the strands.
        where: indices of the card's left and right vertex in the point's row, and the fraction of
            the way from left to right.
    """
    left, right, across = where
    within = g.node("ShaderNodeClamp", {0: across, 1: 0.04, 2: 0.96}).outputs[0]
    uv = g.node("GeometryNodeInputNamedAttribute", data_type="FLOAT_VECTOR")
    uv.inputs["Name"].default_value = item.data.uv_layers[0].name if item.data.uv_layers else ""
    value = next(s for s in uv.outputs if s.enabled)
    ends = [g.taken(mesh, value, i, "FLOAT_VECTOR") for i in (left, right)]
    stored = g.node(
        "GeometryNodeStoreNamedAttribute",
        {"Geometry": curves, "Name": PLACE},
        data_type="FLOAT_VECTOR",
        domain="POINT",
    )
    spot = g.between(ends[0], ends[1], within)
    g.put(spot, next(s for s in stored.inputs if s.name == "Value" and s.enabled))
    return stored.outputs[0]


def _lock(g: _Tree, strand: object, kind: Kind) -> object:
    """The index of a strand's lock; the strand's own index if locks have one strand."""
    if kind.lock == 1:
        return strand
    return g.group(strand, kind.lock)


def _finish(g: _Tree, curves: Socket, points: int, kind: Kind, unit: float) -> Socket:
    """Make strands smooth, of random lengths, and tapered to their tips.

    Args:
        g: the tree.
        curves: the strands.
        points: points per strand.
        kind: kind of strands.
        unit: metres per Blender unit.
    """
    round_ = g.node("GeometryNodeCurveSplineType", spline_type="CATMULL_ROM")
    g.put(curves, round_.inputs["Curve"])
    if kind.coil is None:
        finer = g.node("GeometryNodeResampleCurve", {"Curve": round_.outputs[0], "Count": points})
    else:
        finer = _wound(g, round_.outputs[0], points, kind, kind.coil, unit)
    number = g.node("GeometryNodeInputIndex").outputs[0]
    whole = g.random(1.0 - kind.cut, 1.0, 3, _lock(g, number, kind))
    trimmed = g.node("GeometryNodeTrimCurve", {"Curve": finer.outputs[0]}, mode="FACTOR")
    g.put(whole, next(s for s in trimmed.inputs if s.name == "End" and s.enabled))
    along = g.node("GeometryNodeSplineParameter").outputs["Factor"]
    radius = kind.radius / unit
    thick = g.math("MULTIPLY", g.math("SUBTRACT", 1.0, g.math("POWER", along, 3.0)), radius)
    if kind.root < 1.0:
        grown = g.math("MULTIPLY_ADD", along, (1.0 - kind.root) / _ROOT, kind.root)
        thick = g.math("MULTIPLY", thick, g.math("MINIMUM", grown, 1.0))
    sized = g.node("GeometryNodeSetCurveRadius", {"Curve": trimmed.outputs[0], "Radius": thick})
    return sized.outputs[0]


def _lengths(item: MeshObject, rows: int) -> NDArray[np.float32]:
    """float32[cards]: length of each card along its left edge in Blender units, above 0."""
    places = np.empty(3 * len(item.data.vertices), np.float32)
    item.data.vertices.foreach_get("co", places)
    edge = places.reshape(-1, rows, 2, 3)[:, :, 0]
    return np.maximum(np.linalg.norm(np.diff(edge, axis=1), axis=2).sum(axis=1), 1e-9)


def _points_of(item: MeshObject, rows: int, kind: Kind, unit: float) -> int:
    """The number of points per strand; coils need more, the longer the cards are.

    Args:
        item: mesh of the cards.
        rows: rows of vertices per card.
        kind: kind of strands.
        unit: metres per Blender unit.
    """
    if kind.coil is None:
        return 2 * rows + 2
    turns = float(np.quantile(_lengths(item, rows), 0.9)) * unit / kind.coil.pitch
    return int(np.clip(_OF_A_TURN * turns, 8, _MOST_POINTS))


def _wound(g: _Tree, curves: Socket, points: int, kind: Kind, coil: Coil, unit: float) -> Node:
    """Wind strands about their path.

    The strands of a lock start at nearly the same angle, so that they stay together.

    Args:
        g: the tree.
        curves: smooth strands.
        points: points per strand.
        kind: kind of strands.
        coil: radius and pitch of the winding.
        unit: metres per Blender unit.

    Returns:
        The last of the added nodes, whose output has the wound curves.
    """
    radius, pitch = coil.radius / unit, coil.pitch / unit
    finer = g.node("GeometryNodeResampleCurve", {"Curve": curves, "Count": points})
    strand = g.node("GeometryNodeCurveOfPoint").outputs["Curve Index"]
    way = g.node("GeometryNodeSplineParameter").outputs["Length"]
    begin = g.math(
        "ADD", g.random(0.0, math.tau, 6, _lock(g, strand, kind)), g.random(-0.6, 0.6, 7, strand)
    )
    angle = g.math("ADD", g.math("MULTIPLY", way, math.tau / pitch), begin)
    # The radius grows from 0 at the root to its full value at a length of two radii, so that roots
    # do not form circles.
    far = g.math("MULTIPLY", g.math("MINIMUM", g.math("DIVIDE", way, 2 * radius), 1.0), radius)
    far = g.math("MULTIPLY", far, g.random(0.7, 1.3, 8, strand))
    normal = g.node("GeometryNodeInputNormal").outputs[0]
    tangent = g.node("GeometryNodeInputTangent").outputs[0]
    other = g.node("ShaderNodeVectorMath", {0: tangent, 1: normal}, operation="CROSS_PRODUCT")
    parts_ = []
    for axis, wave in ((normal, "COSINE"), (other.outputs[0], "SINE")):
        part = g.node("ShaderNodeVectorMath", {0: axis}, operation="SCALE")
        g.put(g.math("MULTIPLY", far, g.math(wave, angle)), part.inputs["Scale"])
        parts_.append(part.outputs[0])
    both = g.node("ShaderNodeVectorMath", {0: parts_[0], 1: parts_[1]}, operation="ADD")
    return g.node(
        "GeometryNodeSetPosition", {"Geometry": finer.outputs[0], "Offset": both.outputs[0]}
    )
