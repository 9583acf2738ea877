# SPDX-License-Identifier: MIT
"""glTF and GLB: the mesh with the most morph targets, and what each of these adds to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base import signatures
from ...base.given import GivenError, finite, several
from ...importing import named_json
from ...importing.gltf import Document, is_glb, is_gltf, open_glb, open_gltf
from ...importing.source import decode, read_bytes
from ..geometry.skeleton import Doubles, Ints
from .obj import ObjMesh, ShapeFileError, choose_mesh, refuse_other_kinds

SUFFIXES = (".glb", ".gltf")
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
_TRIANGLES = 4


def read_gltf(path: Path, mesh: str = "") -> tuple[ObjMesh, dict[str, Doubles]]:
    """A mesh of triangles in metres, y up, and float64[V, 3] of each of its morph targets by name.

    Vertices that a glTF has several times, for seams of the texture or of the normals, are one.

    Args:
        path: of the file.
        mesh: its name, where a file has several with morph targets; "": the one with most of them.

    Raises:
        ShapeFileError: no mesh with morph targets, or one of a kind that is not read.
        AnimationFileError: the file is damaged; with the place in it.
        BudgetError: more numbers than a file of this size may hold.
    """
    document = open_document(path)
    number = _choose(document, path, mesh)
    return assembled(document, number)


def open_document(path: Path) -> Document:
    """A glTF whose meshes are read.

    Raises:
        ShapeFileError: another kind of file, or one whose meshes are compressed.
        AnimationFileError: the file is damaged; with the place in it.
    """
    data = read_bytes(path, found=True)
    refuse_other_kinds(path, "a glTF", (signatures.GLB.code,))
    if is_glb(data):
        document = open_glb(path, data)
    else:
        json = named_json.parse(decode(data, str(path)), str(path))
        if not is_gltf(json):
            raise ShapeFileError(f"{path}: a glTF was expected")
        document = open_gltf(path, json)
    used = document.json.get("extensionsRequired") or []
    for name in _COMPRESSED:
        if name in used:
            raise ShapeFileError(f"{path}: {name} is not read: export it without compression")
    return document


def _choose(document: Document, path: Path, wanted: str) -> int:
    """The mesh of that name, or the one with most vertices in morph targets."""
    rows = document.json.get("meshes")
    found = []
    for number, row in enumerate(rows if isinstance(rows, list) else []):
        size = sum(_targets(p) * _vertices(document, p) for p in primitives(document, row, number))
        if size:
            found.append((number, str(row.get("name")), size))
    return choose_mesh(path, "morph targets", found, wanted)


def primitives(document: Document, row: object, number: int) -> list[dict[str, Any]]:
    """The primitives of a mesh.

    Args:
        document: the file.
        row: the mesh in it.
        number: of the mesh.

    Raises:
        AnimationFileError: it has none.
    """
    found = row.get("primitives") if isinstance(row, dict) else None
    if not isinstance(found, list) or not all(isinstance(p, dict) for p in found):
        raise document.fail(f"meshes[{number}]", "primitives were expected")
    return found


def _targets(primitive: Mapping[str, Any]) -> int:
    targets = primitive.get("targets")
    return len(targets) if isinstance(targets, list) else 0


def _vertices(document: Document, primitive: Mapping[str, Any]) -> int:
    attributes = primitive.get("attributes")
    index = attributes.get("POSITION") if isinstance(attributes, dict) else None
    accessor = document.item("accessors", index, "primitives.attributes.POSITION")
    return document.whole(accessor, "count", f"accessors[{index}]")


def assembled(document: Document, number: int) -> tuple[ObjMesh, dict[str, Doubles]]:
    """A mesh and its morph targets, as read_gltf gives them; one without targets too.

    Args:
        document: the file.
        number: of the mesh.

    Raises:
        AnimationFileError: it is damaged; with the place in it.
    """
    row = document.json["meshes"][number]
    place = f"meshes[{number}]"
    parts = [
        _Part(document, primitive, f"{place}.primitives[{i}]")
        for i, primitive in enumerate(primitives(document, row, number))
    ]
    counts = {len(part.deltas) for part in parts}
    if len(counts) != 1:
        raise document.fail(place, "as many morph targets in all primitives were expected")
    names = _names(row, counts.pop())
    turn = _node_matrix(document, number)[:3]
    points = np.concatenate([part.positions for part in parts])
    rows = [np.concatenate(d) for d in zip(*(p.deltas for p in parts), strict=True)]
    deltas = np.stack(rows) if rows else np.zeros((0, len(points), 3))
    begins = np.cumsum([0, *(len(part.positions) for part in parts)])
    corners = np.concatenate([p.corners + b for p, b in zip(parts, begins[:-1], strict=True)])
    uvs = np.concatenate([part.uvs for part in parts])
    first, of = _welded(points, deltas)
    triangles = of[corners]
    whole = (np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)  # none is a line
    mesh = ObjMesh(
        points[first] @ turn[:, :3].T + turn[:, 3],
        uvs,
        triangles[whole].tolist(),
        corners[whole].tolist(),
    )
    moved = deltas[:, first] @ turn[:, :3].T
    return mesh, dict(zip(names, moved, strict=True))


class _Part:
    """The numbers of a primitive."""

    def __init__(self, document: Document, primitive: Mapping[str, Any], place: str) -> None:
        if document.whole(primitive, "mode", place, _TRIANGLES) != _TRIANGLES:
            raise document.fail(f"{place}.mode", "triangles were expected")
        attributes = primitive.get("attributes")
        given = attributes if isinstance(attributes, dict) else {}
        at = f"{place}.attributes"
        self.positions = document.rows(given.get("POSITION"), f"{at}.POSITION", "VEC3")
        count = len(self.positions)
        self.uvs = np.zeros((count, 2))
        if "TEXCOORD_0" in given:
            found = document.rows(given["TEXCOORD_0"], f"{at}.TEXCOORD_0", "VEC2")
            self.uvs = np.stack([found[:, 0], 1 - found[:, 1]], axis=1)  # v points down there
        order: Ints = np.arange(count)
        if "indices" in primitive:
            order = document.rows(primitive["indices"], f"{place}.indices", "SCALAR")[:, 0].astype(
                np.int64
            )
        if len(order) % 3 or (len(order) and not 0 <= order.min() <= order.max() < count):
            raise document.fail(f"{place}.indices", f"triangles of {count} vertices were expected")
        if len(self.uvs) != count:
            raise document.fail(f"{at}.TEXCOORD_0", f"{count} rows were expected")
        self.corners = order.reshape(-1, 3)
        targets = primitive.get("targets")
        self.deltas = [
            self._delta(document, target, f"{place}.targets[{i}]", count)
            for i, target in enumerate(targets if isinstance(targets, list) else [])
        ]

    @staticmethod
    def _delta(document: Document, target: object, place: str, count: int) -> Doubles:
        if not isinstance(target, dict):
            raise document.fail(place, "a table was expected")
        if "POSITION" not in target:
            return np.zeros((count, 3))
        delta = document.rows(target["POSITION"], place, "VEC3")
        if len(delta) != count:
            raise document.fail(place, f"{count} rows were expected, found {len(delta)}")
        return delta


def _names(row: Mapping[str, Any], count: int) -> list[str]:
    """What exporters call the targets; each name once."""
    extras = row.get("extras")
    given = extras.get("targetNames") if isinstance(extras, dict) else None
    rows = given if isinstance(given, list) and len(given) == count else [None] * count
    out: list[str] = []
    for number, name in enumerate(rows):
        own = name if isinstance(name, str) and name else f"target{number}"
        while own in out:
            own += "_"
        out.append(own)
    return out


def _welded(points: Doubles, deltas: Doubles) -> tuple[Ints, Ints]:
    """One of each vertex that lies and moves alike, in the file's order; and which one each is."""
    keys = np.concatenate([points, deltas.transpose(1, 0, 2).reshape(len(points), -1)], axis=1)
    keys = np.ascontiguousarray(keys.astype(np.float32)) + np.float32(0.0)  # -0 is 0
    rows = keys.view(np.dtype((np.void, keys.shape[1] * keys.itemsize))).ravel()
    _, first, of = np.unique(rows, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return first[order], place[of.ravel()]


def _node_matrix(document: Document, mesh: int) -> Doubles:
    """float64[4, 4] of the first node with the mesh in the world; one for a mesh that none has."""
    nodes = document.json.get("nodes")
    rows = nodes if isinstance(nodes, list) else []
    # What is skinned stands where its joints are, which rest as the mesh lies.
    found = next((n for n, node in enumerate(rows) if isinstance(node, dict)
                  and node.get("mesh") == mesh and "skin" not in node), -1)  # fmt: skip
    return world_matrix(document, found)


def world_matrix(document: Document, found: int) -> Doubles:
    """float64[4, 4] of a node in the world.

    Args:
        document: the file.
        found: number of the node; below 0: none, which stands nowhere else.

    Raises:
        AnimationFileError: a node that is damaged; with the place in it.
    """
    nodes = document.json.get("nodes")
    rows = nodes if isinstance(nodes, list) else []
    parents: dict[int, int] = {}
    for number, node in enumerate(rows):
        if not isinstance(node, dict):
            raise document.fail(f"nodes[{number}]", "a table was expected")
        children = node.get("children")
        for child in children if isinstance(children, list) else []:
            if isinstance(child, int):
                parents[child] = number
    out = np.eye(4)
    for _ in range(len(rows)):
        if found < 0:
            break
        out = _local(document, rows[found], f"nodes[{found}]") @ out
        found = parents.get(found, -1)
    return out


def _local(document: Document, node: Mapping[str, Any], place: str) -> Doubles:
    def numbers(key: str, default: list[float]) -> Doubles:
        value = node.get(key, default)
        try:
            found = several(value, finite)
        except GivenError:
            found = ()
        if len(found) != len(default):
            raise document.fail(f"{place}.{key}", f"{len(default)} finite numbers were expected")
        return np.array(found, np.float64)

    if "matrix" in node:
        return numbers("matrix", [0.0] * 16).reshape(4, 4).T
    x, y, z, w = numbers("rotation", [0.0, 0.0, 0.0, 1.0])
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, :3] *= numbers("scale", [1.0, 1.0, 1.0])
    out[:3, 3] = numbers("translation", [0.0, 0.0, 0.0])
    return out
