# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards of hair as Blender's hair curves, in renders: curves whose nodes follow the cards.

Each card is a guide with a width. Strands lie across it, go where its deformed vertices go, and
take the place of the cards in renders; the viewport and exports keep the cards.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import bpy

from ..base import compat, parts
from ..base.blender_types import ArmatureObject, MeshObject, Node, NodeTree, Socket
from ..character import runtime

STRANDS = "risorius_strands"  # on a mesh of cards: the object that renders show instead
_TREE = "Risorius Strands"
_CARDS = "Cards"  # input of the modifier: the mesh that is followed
_PLACE = "strand_uv"  # attribute of the curves: where in the picture their colour is
_DEEPER = 1.6  # exponent of the colour of fibres that lie close
_ROWS = re.compile(r"rows=(\d+)")


class _Kind(NamedTuple):
    """How strands differ from the card that they follow."""

    each: int  # strands of a card
    radius: float  # at the root, metres
    apart: float  # how far tips part, metres
    cut: float  # of their length, what is cut off at most
    # Roots stand between the cards' too, or each card would be a tuft: how far over either edge, in
    # the card's widths, and how far before or behind the card's root, in rows.
    aside: float
    along: float
    # Light goes from fibre to fibre where they lie close; single ones over skin are as the picture
    # shows them, and fibres that let light through would be darker there.
    dense: bool


_KINDS = {  # by what the name of a mesh begins with
    "hair": _Kind(32, 0.00008, 0.0015, 0.45, 0.2, 0.3, True),
    "brows": _Kind(4, 0.00005, 0.0004, 0.35, 0.3, 0.3, False),
    "beard": _Kind(12, 0.00005, 0.0015, 0.5, 0.9, 0.7, False),
    "eyelashes": _Kind(3, 0.00006, 0.0003, 0.25, 0.0, 0.0, False),
}


def cards(rig: ArmatureObject) -> Iterator[tuple[MeshObject, str, int]]:
    """The meshes of a character that are cards of hair, their names in the file, and the rows of a
    card.

    Args:
        rig: the deforming armature.
    """
    live = runtime.of(rig)
    if live is None:
        return
    names, told = live.dna.mesh_names, live.dna.metadata
    for item in parts.meshes_of(rig):
        number = int(item.get(parts.MESH, -1))
        name = names[number] if 0 <= number < len(names) else ""
        found = _ROWS.fullmatch(told.get(f"hair:{name}", ""))
        if found and len(item.data.vertices) % (2 * int(found[1])) == 0:
            yield item, name, int(found[1])


def _strands_of(item: MeshObject) -> bpy.types.Object | None:
    found = item.get(STRANDS)
    return found if isinstance(found, bpy.types.Object) else None


def are_shown(rig: ArmatureObject) -> bool:
    """Whether renders of a character show strands."""
    return any(_strands_of(item) is not None for item, _, _ in cards(rig))


def show(rig: ArmatureObject, unit: float) -> int:
    """Let renders of a character show strands; how many meshes have them.

    Args:
        rig: the deforming armature.
        unit: metres per Blender unit.
    """
    count = 0
    for item, name, rows in cards(rig):
        kind = next((k for begin, k in _KINDS.items() if name.startswith(begin)), None)
        if _strands_of(item) is None:
            if kind is None or item.hide_render:
                continue
            _add(item, rows, kind, unit)
        count += 1
    return count


def _add(item: MeshObject, rows: int, kind: _Kind, unit: float) -> None:
    data = bpy.data.hair_curves.new(f"{item.name}_strands")
    thing = bpy.data.objects.new(f"{item.name}_strands", data)
    for collection in item.users_collection:
        collection.objects.link(thing)
    thing.parent = item
    modifier: Any = thing.modifiers.new(_TREE, "NODES")
    tree: Any = _tree(item, rows, kind, unit)
    modifier.node_group = tree
    # An input of the modifier, so that a copied face has strands that follow its own cards.
    modifier[tree.interface.items_tree[_CARDS].identifier] = item
    thing.hide_viewport = thing.hide_select = True
    parts.point(item, STRANDS, thing)
    item.hide_render = True


def hide(rig: ArmatureObject) -> None:
    """Let renders of a character show cards again.

    Args:
        rig: the deforming armature.
    """
    for item, _, _ in cards(rig):
        thing = _strands_of(item)
        if thing is None:
            continue
        data: Any = thing.data
        modifiers: Any = thing.modifiers
        trees = [m.node_group for m in modifiers if m.type == "NODES"]
        bpy.data.objects.remove(thing)
        bpy.data.hair_curves.remove(data)
        for tree in trees:
            materials = [
                n.inputs["Material"].default_value for n in tree.nodes if n.type == "SET_MATERIAL"
            ]
            bpy.data.node_groups.remove(tree)
            for material in materials:
                if material is not None and not material.users:
                    bpy.data.materials.remove(material)
        del item[STRANDS]
        item.hide_render = False


class _Tree:
    """Short words for a geometry node tree."""

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

    def random(self, low: float, high: float, seed: int, number: object) -> Socket:
        """A number of its own for each strand."""
        node = self.node("FunctionNodeRandomValue", {2: low, 3: high, "ID": number, "Seed": seed})
        return node.outputs[1]

    def taken(self, mesh: object, value: object, index: object, kind: str) -> Socket:
        """A value of a vertex of the cards."""
        node = self.node("GeometryNodeSampleIndex", data_type=kind, domain="POINT")
        self.put(mesh, node.inputs[0])
        self.put(value, next(s for s in node.inputs if s.name == "Value" and s.enabled))
        self.put(index, node.inputs["Index"])
        return next(s for s in node.outputs if s.enabled)

    def between(self, a: object, b: object, share: object) -> Socket:
        """A vector between two, or beyond them where the share is."""
        node = self.node("ShaderNodeMix", data_type="VECTOR", clamp_factor=False)
        where = {s.identifier: s for s in node.inputs}
        for value, name in ((share, "Factor_Float"), (a, "A_Vector"), (b, "B_Vector")):
            self.put(value, where[name])
        return next(s for s in node.outputs if s.identifier == "Result_Vector")


def _tree(item: MeshObject, rows: int, kind: _Kind, unit: float) -> NodeTree:
    """Nodes that turn the cards of a mesh into strands."""
    tree: Any = bpy.data.node_groups.new(_TREE, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    g = _Tree(tree)
    tree.interface.new_socket(_CARDS, in_out="INPUT", socket_type="NodeSocketObject")
    given = g.node("NodeGroupInput").outputs[_CARDS]
    source = g.node("GeometryNodeObjectInfo", {"Object": given}, transform_space="RELATIVE")
    mesh = source.outputs["Geometry"]
    count = kind.each * len(item.data.vertices) // (2 * rows)
    line = g.node("GeometryNodeCurvePrimitiveLine")
    line = g.node("GeometryNodeResampleCurve", {"Curve": line.outputs[0], "Count": rows})
    dots = g.node("GeometryNodePoints", {"Count": count})
    many = g.node("GeometryNodeInstanceOnPoints", {0: dots.outputs[0], "Instance": line.outputs[0]})
    real = g.node("GeometryNodeRealizeInstances", {0: many.outputs[0]})
    # All strands have as many points as a card has rows: numbers follow from a point's own.
    index = g.node("GeometryNodeInputIndex").outputs[0]
    strand = g.math("FLOOR", g.math("DIVIDE", g.math("ADD", index, 0.5), rows))
    card = g.math("FLOOR", g.math("DIVIDE", g.math("ADD", strand, 0.5), kind.each))
    row = g.math("SUBTRACT", index, g.math("MULTIPLY", strand, rows))
    left = g.math("MULTIPLY", g.math("ADD", g.math("MULTIPLY", card, rows), row), 2)
    right = g.math("ADD", left, 1)
    # A strand wanders a little across its card.
    across = g.random(0.04 - kind.aside, 0.96 + kind.aside, 1, strand)
    lean = g.random(-0.1, 0.1, 2, strand)
    across = g.math("ADD", across, g.math("MULTIPLY", lean, g.math("DIVIDE", row, rows)))
    place = g.node("GeometryNodeInputPosition").outputs[0]
    ends = [g.taken(mesh, place, i, "FLOAT_VECTOR") for i in (left, right)]
    if kind.along:
        # Beyond the last row a card goes on as it went.
        back = g.math("MULTIPLY", g.math("GREATER_THAN", row, rows - 1.5), 2)
        share = g.random(-kind.along, 0.4 * kind.along, 5, strand)
        starts = [g.math("SUBTRACT", i, back) for i in (left, right)]
        ends = [
            _slid(g, mesh, place, end, start, share)
            for end, start in zip(ends, starts, strict=True)
        ]
    parted = g.node("FunctionNodeRandomValue", {"ID": strand, "Seed": 4}, data_type="FLOAT_VECTOR")
    parted.inputs["Min"].default_value = [-kind.apart / unit] * 3
    parted.inputs["Max"].default_value = [kind.apart / unit] * 3
    aside = g.node("ShaderNodeVectorMath", {0: parted.outputs["Value"]}, operation="SCALE")
    g.put(g.math("DIVIDE", row, rows - 1), aside.inputs["Scale"])
    moved = g.node(
        "GeometryNodeSetPosition",
        {
            "Geometry": real.outputs[0],
            "Position": g.between(ends[0], ends[1], across),
            "Offset": aside.outputs[0],
        },
    )
    stored = _store_place(g, item, mesh, moved.outputs[0], (left, right, across))
    finished = _finish(g, stored, 2 * rows + 2, 1.0 - kind.cut, kind.radius / unit)
    painted = g.node(
        "GeometryNodeSetMaterial", {"Geometry": finished, "Material": _material(item, kind.dense)}
    )
    out = g.node("NodeGroupOutput")
    tree.links.new(painted.outputs[0], out.inputs[0])
    return tree


def _slid(
    g: _Tree, mesh: Socket, place: Socket, end: Socket, start: Socket, share: Socket
) -> Socket:
    """Where a vertex of a card is once a strand has slid along it.

    Args:
        g: the tree.
        mesh: the cards as they are deformed.
        place: of a vertex.
        end: where the vertex is.
        start: number of the vertex of its edge from which the way to the next row is taken.
        share: of that way.
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
    """Curves that know where in the cards' picture each point is.

    Args:
        g: the tree.
        item: the cards.
        mesh: the cards as they are deformed.
        curves: the strands.
        where: numbers of the vertices left and right of a point, and where it is between them.
    """
    left, right, across = where
    within = g.node("ShaderNodeClamp", {0: across, 1: 0.04, 2: 0.96}).outputs[0]
    uv = g.node("GeometryNodeInputNamedAttribute", data_type="FLOAT_VECTOR")
    uv.inputs["Name"].default_value = item.data.uv_layers[0].name if item.data.uv_layers else ""
    value = next(s for s in uv.outputs if s.enabled)
    ends = [g.taken(mesh, value, i, "FLOAT_VECTOR") for i in (left, right)]
    stored = g.node(
        "GeometryNodeStoreNamedAttribute",
        {"Geometry": curves, "Name": _PLACE},
        data_type="FLOAT_VECTOR",
        domain="POINT",
    )
    spot = g.between(ends[0], ends[1], within)
    g.put(spot, next(s for s in stored.inputs if s.name == "Value" and s.enabled))
    return stored.outputs[0]


def _finish(g: _Tree, curves: Socket, points: int, least: float, radius: float) -> Socket:
    """Strands as smooth curves of many lengths that taper to their tips.

    Args:
        g: the tree.
        curves: the strands.
        points: of each.
        least: of the length, what a strand has at least.
        radius: at the root, in Blender units.
    """
    round_ = g.node("GeometryNodeCurveSplineType", spline_type="CATMULL_ROM")
    g.put(curves, round_.inputs["Curve"])
    finer = g.node("GeometryNodeResampleCurve", {"Curve": round_.outputs[0], "Count": points})
    number = g.node("GeometryNodeInputIndex").outputs[0]
    whole = g.random(least, 1.0, 3, number)
    trimmed = g.node("GeometryNodeTrimCurve", {"Curve": finer.outputs[0]}, mode="FACTOR")
    g.put(whole, next(s for s in trimmed.inputs if s.name == "End" and s.enabled))
    along = g.node("GeometryNodeSplineParameter").outputs["Factor"]
    thick = g.math("MULTIPLY", g.math("SUBTRACT", 1.0, g.math("POWER", along, 3.0)), radius)
    sized = g.node("GeometryNodeSetCurveRadius", {"Curve": trimmed.outputs[0], "Radius": thick})
    return sized.outputs[0]


def _material(item: MeshObject, dense: bool) -> bpy.types.Material:
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
    source: Any = cards_look.node_tree if cards_look is not None else None
    pictures = [n for n in source.nodes if n.type == "TEX_IMAGE" and n.image] if source else []
    colour = None
    if pictures:
        spot = tree.nodes.new("ShaderNodeAttribute")
        spot.attribute_name = _PLACE
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
    fibre.inputs["Roughness"].default_value = 0.4
    fibre.inputs["IOR"].default_value = 1.4  # oiled: with 1.55 light from behind makes it grey
    if colour is not None:
        # Light goes through several fibres: what the picture shows is what they give together.
        deep = tree.nodes.new("ShaderNodeGamma")
        deep.inputs["Gamma"].default_value = _DEEPER
        tree.links.new(colour, deep.inputs["Color"])
        tree.links.new(deep.outputs["Color"], fibre.inputs["Color"])
    cycles = tree.nodes.new("ShaderNodeOutputMaterial")
    cycles.target, output.target = "CYCLES", "EEVEE"
    tree.links.new(fibre.outputs[0], cycles.inputs["Surface"])
