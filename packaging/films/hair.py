# SPDX-License-Identifier: MIT
"""Makes hair by geometry nodes along a band of cloth. Blender simulates only the band."""

from __future__ import annotations

import bpy

MM = 0.001
EACH = 44  # number of hairs per edge of the band
REACH = (2.6 * MM, 2.2 * MM, 2.0 * MM)  # largest offset of a hair from its edge in x, y, z, metres
SPREAD = ((0.0, 0.85), (0.3, 1.0), (0.75, 0.8), (1.0, 0.45))  # (fraction from root to tip, x REACH)
ROOTS, TIPS = (0.0, 0.07), (0.72, 1.0)  # ranges of a hair's start and end, fractions of its edge
RADIUS = 0.09 * MM


def add(tree, kind, inputs=(), **settings):
    """Add a node to a node tree and return it.

    Args:
        tree: the node tree.
        kind: the node's type, for example "NodeGroupInput".
        inputs: (name or index of an input socket, default value) pairs.
        settings: attributes of the node.
    """
    node = tree.nodes.new(kind)
    for key, value in settings.items():
        setattr(node, key, value)
    for name, value in inputs:
        node.inputs[name].default_value = value
    return node


def chance(tree, low, high, seed):
    """Returns an output socket: a random number per hair between `low` and `high`."""
    node = add(tree, "FunctionNodeRandomValue", [(2, low), (3, high), ("Seed", seed)])
    return node.outputs[1]


def offset(tree):
    """Returns an output socket: the offset of each point of a hair from its edge.

    Each hair has a random vector within REACH; SPREAD scales it along the hair.
    """
    place = add(tree, "FunctionNodeRandomValue", data_type="FLOAT_VECTOR")
    place.inputs["Min"].default_value = [-r for r in REACH]
    place.inputs["Max"].default_value = REACH
    hair = add(tree, "GeometryNodeFieldOnDomain", domain="CURVE", data_type="FLOAT_VECTOR")
    along = add(tree, "GeometryNodeSplineParameter")
    spread = add(tree, "ShaderNodeFloatCurve")
    points = spread.mapping.curves[0].points
    for x, y in SPREAD[1:-1]:
        points.new(x, y)
    points[0].location, points[-1].location = SPREAD[0], SPREAD[-1]
    spread.mapping.update()
    scaled = add(tree, "ShaderNodeVectorMath", operation="SCALE")
    tree.links.new(place.outputs["Value"], hair.inputs["Value"])
    tree.links.new(along.outputs["Factor"], spread.inputs["Value"])
    tree.links.new(hair.outputs["Value"], scaled.inputs[0])
    tree.links.new(spread.outputs["Value"], scaled.inputs["Scale"])
    return scaled.outputs[0]


def grow(band, material):
    """Show hair along the edges of a band instead of the band.

    Args:
        band: an object whose mesh has the attribute `along` at the edges that hairs follow.
        material: the material of the hairs.
    """
    tree = bpy.data.node_groups.new("Hair", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    name = [("Name", "along")]
    along = add(tree, "GeometryNodeInputNamedAttribute", name, data_type="BOOLEAN")
    circle = [("Resolution", 4), ("Radius", RADIUS)]
    profile = add(tree, "GeometryNodeCurvePrimitiveCircle", circle, mode="RADIUS")
    curves = add(tree, "GeometryNodeMeshToCurve")
    smooth = add(tree, "GeometryNodeCurveSplineType", spline_type="CATMULL_ROM")
    finer = add(tree, "GeometryNodeResampleCurve", [("Count", 60)])
    several = add(tree, "GeometryNodeDuplicateElements", [("Amount", EACH)], domain="SPLINE")
    moved = add(tree, "GeometryNodeSetPosition")
    cut = add(tree, "GeometryNodeTrimCurve", mode="FACTOR")
    tubes = add(tree, "GeometryNodeCurveToMesh")
    painted = add(tree, "GeometryNodeSetMaterial", [("Material", material)])
    links = tree.links
    links.new(along.outputs["Attribute"], curves.inputs["Selection"])
    links.new(offset(tree), moved.inputs["Offset"])
    links.new(chance(tree, *ROOTS, 1), cut.inputs["Start"])
    links.new(chance(tree, *TIPS, 0), cut.inputs["End"])
    links.new(profile.outputs["Curve"], tubes.inputs["Profile Curve"])
    last = add(tree, "NodeGroupInput").outputs[0]
    for node in (curves, smooth, finer, several, moved, cut, tubes, painted):
        links.new(last, node.inputs[0])
        last = node.outputs[0]
    links.new(last, add(tree, "NodeGroupOutput").inputs[0])
    band.modifiers.new("Hair", "NODES").node_group = tree
