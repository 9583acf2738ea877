# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders cards of hair as Blender hair curves, which geometry nodes compute from the cards.

The strands are spread over the width of each card and follow its deformed vertices. They replace
the cards in renders; the viewport and exports keep the cards.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import bpy

from ..base import parts
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import runtime
from .strand_kinds import Kind, kind_of, thicker
from .strand_nodes import CARDS, TREE, strand_tree

STRANDS = "risorius_strands"  # property of a mesh of cards: the hair curves shown in renders
_ROWS = re.compile(r"rows=(\d+)")
_LEVEL = re.compile(r"_lod\d+_")


def cards(rig: ArmatureObject) -> Iterator[tuple[MeshObject, str, int]]:
    """Yields (mesh object, name of the mesh in the DNA file, number of vertex rows in each card).

    Only the meshes of a character that are hair cards are yielded.

    Args:
        rig: the deforming armature.
    """
    live = runtime.of(rig)
    if live is None:
        return
    names, told = live.dna.mesh_names, live.dna.metadata
    for item in parts.meshes_of(rig):
        number = int(item[parts.MESH])
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
    """Let renders of a character show strands.

    Meshes of cards that are hidden in renders get no strands.

    Args:
        rig: the deforming armature.
        unit: metres per Blender unit.

    Returns:
        The number of meshes with strands.
    """
    count = 0
    live = runtime.of(rig)
    if live is None:
        return count
    for item, name, rows in cards(rig):
        if _strands_of(item) is None:
            kind = kind_of(name, live.dna.metadata)
            if kind is None or item.hide_render:
                continue
            more = _cards_at_finest(live, name) * 2 * rows / len(item.data.vertices)
            _add(item, rows, thicker(kind, more), unit)
        count += 1
    return count


def _cards_at_finest(live: runtime.Runtime, name: str) -> int:
    """The number of cards of a mesh at LOD 0; coarser levels have fewer and wider cards. 0 if the
    file has no such mesh at LOD 0.

    Args:
        live: Runtime of the character.
        name: name of the mesh in the DNA file; the mesh may belong to any LOD.
    """
    finest = _LEVEL.sub("_lod0_", name)
    found = _ROWS.fullmatch(live.dna.metadata.get(f"hair:{finest}", ""))
    names = list(live.dna.mesh_names)
    if found is None or finest not in names:
        return 0
    return len(live.dna.meshes[names.index(finest)].positions) // (2 * int(found[1]))


def _add(item: MeshObject, rows: int, kind: Kind, unit: float) -> None:
    data = bpy.data.hair_curves.new(f"{item.name}_strands")
    thing = bpy.data.objects.new(f"{item.name}_strands", data)
    for collection in item.users_collection:
        collection.objects.link(thing)
    thing.parent = item
    modifier: Any = thing.modifiers.new(TREE, "NODES")
    tree: Any = strand_tree(item, rows, kind, unit)
    modifier.node_group = tree
    # The cards are an input of the modifier, so that strands of a copied face follow the copy.
    modifier[tree.interface.items_tree[CARDS].identifier] = item
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
