# SPDX-License-Identifier: MIT
"""Finds the nodes of a body, their positions in the scene, and the nodes that are bones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.given import shown
from ...importing.gltf import Document
from ..avatar import humanoid

Doubles = npt.NDArray[np.float64]

_MOST = 20_000  # largest number of nodes of a file


@dataclass(frozen=True)
class Tree:
    """The nodes of the scene.

    Attributes:
        order: numbers of the nodes in the file, parents before their children.
        above: number of a node -> number of its parent, -1 for a root.
        world: number of a node -> float64[4, 4], matrix from the node to the scene.
    """

    order: list[int]
    above: dict[int, int]
    world: dict[int, Doubles]


def find_tree(document: Document) -> Tree:
    """The nodes of the file's default scene (the first one if the file names none), or all nodes if
    the file has no scene.

    Args:
        document: the file of the body.

    Raises:
        AnimationFileError: there are no nodes or more than 20,000, a node has two parents or is its
            own ancestor, or a position is not a list of numbers.
    """
    rows = document.json.get("nodes")
    if not isinstance(rows, list) or not rows:
        raise document.fail("nodes", "a body with a skeleton was expected, found no node")
    if len(rows) > _MOST:
        raise document.fail("nodes", f"at most {_MOST:,} nodes were expected, found {len(rows):,}")
    tree = Tree([], {}, {})
    waiting = [(root, -1) for root in _roots(document, rows)]
    while waiting:
        number, parent = waiting.pop(0)
        if number in tree.above:
            raise document.fail(
                f"nodes[{number}]",
                "a node with one parent was expected, found two parents or a circle",
            )
        node = document.item("nodes", number, f"nodes[{number}]")
        own = document.transform(node, f"nodes[{number}]")
        tree.world[number] = tree.world[parent] @ own if parent >= 0 else own
        tree.above[number] = parent
        tree.order.append(number)
        waiting += [(child, number) for child in _listed(document, node, number)]
    if not all(np.isfinite(matrix).all() for matrix in tree.world.values()):
        raise document.fail("nodes", "finite positions of nodes were expected")
    return tree


def _listed(document: Document, node: dict[str, Any], number: int) -> list[int]:
    """Numbers of a node's children."""
    children = node.get("children", [])
    if not isinstance(children, list):
        raise document.fail(
            f"nodes[{number}].children", f"a list was expected, found {shown(children)}"
        )
    for child in children:
        document.item("nodes", child, f"nodes[{number}].children")
    return children


def _roots(document: Document, rows: list[Any]) -> list[int]:
    scenes = document.json.get("scenes")
    if isinstance(scenes, list) and scenes:
        scene = document.item("scenes", document.json.get("scene", 0), "scene")
        roots = scene.get("nodes", [])
        if not isinstance(roots, list):
            raise document.fail("scene.nodes", f"a list was expected, found {shown(roots)}")
        for root in roots:
            document.item("nodes", root, "scene.nodes")
        return list(dict.fromkeys(roots))
    below = {
        child
        for number in range(len(rows))
        for child in _listed(document, document.item("nodes", number, "nodes"), number)
    }
    return [number for number in range(len(rows)) if number not in below]


def bones_of(document: Document, tree: Tree, joints: set[int]) -> dict[str, int]:
    """The bones of a humanoid: name in VRM 1.0 -> number of the node.

    Args:
        document: the file of the body, whose VRM extension lists the bones.
        tree: the nodes of the file.
        joints: nodes that are joints of a skin. If the file has no VRM extension, the names of
            nodes decide; `joints` and their ancestors are preferred to other nodes.
    """
    found = {name: node for name, node in _said(document) if node in tree.above}
    if found:
        return {name: node for name, node in found.items() if name in humanoid.BONES}
    names = dict[str, int]()
    near = joints | {a for joint in joints for a in _chain(tree, joint)}
    rows = document.json["nodes"]
    free = {number for number in tree.order if number not in near and "mesh" not in rows[number]}
    for candidates in (near, free):  # a hand that moves no vertex may be in no skin
        for number in tree.order:
            if number in candidates:
                name = humanoid.bone_of(str(rows[number].get("name", "")))
                if name:
                    names.setdefault(name, number)
    return names


def _chain(tree: Tree, number: int) -> list[int]:
    out = [number]
    while tree.above[out[-1]] >= 0:
        out.append(tree.above[out[-1]])
    return out


def _said(document: Document) -> list[tuple[str, int]]:
    """(VRM 1.0 name of a bone, number of its node) for each bone in the file's VRM extension."""
    extensions = document.json.get("extensions")
    tables = extensions if isinstance(extensions, dict) else {}
    out = list[tuple[str, int]]()
    for key in ("VRMC_vrm", "VRM"):
        own = tables.get(key)
        part = own.get("humanoid") if isinstance(own, dict) else None
        bones = part.get("humanBones") if isinstance(part, dict) else None
        if isinstance(bones, dict):
            rows = list(bones.items())
        elif isinstance(bones, list):
            rows = [(row.get("bone"), row) for row in bones if isinstance(row, dict)]
        else:
            rows = []
        for name, row in rows:
            node = row.get("node") if isinstance(row, dict) else None
            if isinstance(name, str) and isinstance(node, int) and not isinstance(node, bool):
                is_old = isinstance(bones, list)
                out.append((humanoid.new_bone(name) if is_old else name, node))
    return out
