# SPDX-License-Identifier: MIT
"""Reads the meshes of a body, with vertices in the scene's coordinates.

A mesh with a skin is read in the rest pose of its joints. So the exported nodes of the meshes need
neither scale nor rotation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.given import GivenError, shown
from ...importing.gltf import COORDINATES, FLOATS, INDICES, Document
from ...importing.packed.draco import EXTENSION as DRACO

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_SIZES = {"VEC2": 2, "VEC3": 3, "VEC4": 4, "SCALAR": 1}
_KINDS = {"POSITION": "VEC3", "NORMAL": "VEC3", "TANGENT": "VEC4"}


@dataclass
class Piece:
    """A primitive of a mesh.

    Attributes:
        values: name of an attribute -> float32[V, n], or uint16[V, 4] for JOINTS; positions are in
            the scene, in metres.
        indices: int64[n], the vertex of each corner; None: each vertex is used once, in order.
        mode: glTF's code of the primitive's kind, e.g. 4 for triangles.
        material: number of its material in the body's file; -1 for none.
        targets: for each morph target, name of an attribute -> float32[V, 3], change at weight 1.
    """

    values: dict[str, npt.NDArray[Any]]
    indices: Ints | None
    mode: int
    material: int
    targets: list[dict[str, npt.NDArray[np.float32]]]


@dataclass
class BodyMesh:
    """The mesh of a node.

    Attributes:
        name: name of the node; the mesh's name if the node has none.
        also: name of the mesh.
        joints: numbers of the nodes that are the joints of its skin; without a skin, the number of
            the node that moves it.
        pieces: its primitives that have vertices.
        targets: names of its morph targets.
    """

    name: str
    also: str
    joints: list[int]
    pieces: list[Piece]
    targets: list[str]


class Meshes:
    """Reads the meshes of nodes; primitives that share their accessors are read once per node."""

    def __init__(self, document: Document, world: Mapping[int, Doubles]) -> None:
        """Prepare for reading.

        Args:
            document: the file of the body.
            world: number of a node -> float64[4, 4] from the node to the scene, in metres.
        """
        self._document, self._world = document, world
        self._known: dict[str, tuple[dict[str, Any], list[dict[str, Any]], bool]] = {}

    def joints(self, node: int) -> list[int]:
        """The joints of the skin of a node's mesh; the node itself if the mesh has no skin.

        Args:
            node: number of a node with a mesh.

        Raises:
            AnimationFileError: the skin does not exist, or its joints are outside of the scene.
        """
        row = self._document.json["nodes"][node]
        if "skin" not in row:
            return [node]
        skin = self._document.item("skins", row["skin"], f"nodes[{node}].skin")
        joints, at = skin.get("joints"), f"skins[{row['skin']}].joints"
        if not isinstance(joints, list) or not joints:
            raise self._document.fail(at, f"nodes were expected, found {shown(joints)}")
        for joint in joints:
            self._document.item("nodes", joint, at)
            if joint not in self._world:
                raise self._document.fail(at, f"nodes of the scene were expected, found {joint}")
        return joints

    def read(self, node: int) -> BodyMesh:
        """Read the mesh of a node.

        Args:
            node: number of the node.

        Raises:
            AnimationFileError: the mesh is damaged; the error names the place in the file.
            BudgetError: the mesh is too large in proportion to the file.
        """
        document = self._document
        row = document.json["nodes"][node]
        number = row["mesh"]
        mesh = document.item("meshes", number, f"nodes[{node}].mesh")
        joints = self.joints(node)
        moves = self._moves(node, joints)
        primitives = mesh.get("primitives")
        pieces = [
            self._piece(primitive, f"meshes[{number}].primitives[{i}]", moves, node)
            for i, primitive in enumerate(primitives if isinstance(primitives, list) else [])
        ]
        also = str(mesh.get("name") or f"mesh{number}")
        count = max((len(p.targets) for p in pieces), default=0)
        pieces = [piece for piece in pieces if len(piece.values["POSITION"])]
        name = str(row.get("name") or also)
        return BodyMesh(name, also, joints, pieces, target_names(mesh, count))

    def _moves(self, node: int, joints: Sequence[int]) -> Doubles:
        """float64[joints, 4, 4], per joint the matrix from the mesh's coordinates to the scene."""
        world = np.stack([self._world[joint] for joint in joints])
        row = self._document.json["nodes"][node]
        skin = self._document.json["skins"][row["skin"]] if "skin" in row else {}
        if "inverseBindMatrices" not in skin:
            return world
        at = f"skins[{row['skin']}].inverseBindMatrices"
        found = self._document.rows(skin["inverseBindMatrices"], at, "MAT4", FLOATS)
        if len(found) < len(joints):
            raise self._document.fail(
                at, f"{len(joints)} matrices were expected, found {len(found)}"
            )
        inverse = found[: len(joints)].reshape(-1, 4, 4).swapaxes(1, 2)
        return np.asarray(world @ inverse, np.float64)

    def _piece(self, primitive: object, at: str, moves: Doubles, node: int) -> Piece:
        document = self._document
        if not isinstance(primitive, dict) or not isinstance(primitive.get("attributes"), dict):
            raise document.fail(at, "a table of attributes was expected")
        material = primitive.get("material", -1)
        if "material" in primitive:
            document.item("materials", material, f"{at}.material")
        packed = _Lists(document, primitive, at)
        key = repr((primitive["attributes"], primitive.get("targets"), primitive.get("extensions")))
        key += f" {node}"
        if key not in self._known:
            self._known[key] = self._baked(primitive, packed, at, moves)
        values, targets, is_mirrored = self._known[key]
        indices = packed.indices(len(values["POSITION"]))
        mode = document.whole(primitive, "mode", at, 4)
        if is_mirrored and mode == 4:
            if indices is None:
                indices = np.arange(len(values["POSITION"]))
            indices = indices[: len(indices) // 3 * 3].reshape(-1, 3)[:, ::-1].ravel()
        return Piece(values, indices, mode, material, targets)

    def _baked(
        self, primitive: Mapping[str, Any], lists: _Lists, at: str, moves: Doubles
    ) -> tuple[dict[str, Any], list[dict[str, Any]], bool]:
        document = self._document
        given = primitive["attributes"]
        values = {name: lists.rows(name, f"{at}.attributes.{name}") for name in given
                  if not name.startswith("_")}  # fmt: skip
        if "POSITION" not in values:
            raise document.fail(at, "vertex positions (POSITION) were expected, found none")
        count = len(values["POSITION"])
        for name, rows in values.items():
            if len(rows) != count:
                raise document.fail(
                    f"{at}.attributes.{name}", f"{count} rows were expected, found {len(rows)}"
                )
        document.budget.hold(count * 12 * 8, at)
        blended = _blended(document, values, moves, at)
        linear = blended[:, :3, :3]
        out: dict[str, Any] = {name: rows.astype("<f4") for name, rows in values.items()}
        for name in [name for name in out if name.startswith("JOINTS_")]:
            out[name] = values[name].astype("<u2")
        places = np.einsum("vij,vj->vi", linear, values["POSITION"]) + blended[:, :3, 3]
        if not np.isfinite(places).all() or np.abs(places).max(initial=0.0) > 1e6:
            raise document.fail(at, "vertices within 1,000 km of the origin were expected")
        out["POSITION"] = places.astype("<f4")
        turn = _cofactors(linear)
        if "NORMAL" in values:
            out["NORMAL"] = _unit(np.einsum("vij,vj->vi", turn, values["NORMAL"])).astype("<f4")
        if "TANGENT" in values:
            tangents = _unit(np.einsum("vij,vj->vi", linear, values["TANGENT"][:, :3]))
            out["TANGENT"] = np.c_[tangents, values["TANGENT"][:, 3:]].astype("<f4")
        is_mirrored = bool(np.linalg.det(linear[:1]).sum() < 0)
        return out, self._targets(primitive, at, linear, turn), is_mirrored

    def _targets(
        self, primitive: Mapping[str, Any], at: str, linear: Doubles, turn: Doubles
    ) -> list[dict[str, Any]]:
        rows = primitive.get("targets", [])
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise self._document.fail(f"{at}.targets", "a list of tables was expected")
        scale = np.cbrt(np.abs(np.linalg.det(linear)))[:, None, None]
        bent = turn / np.maximum(scale, 1e-12) ** 2
        out = list[dict[str, Any]]()
        for i, row in enumerate(rows):
            made = {}
            for name, moved in (("POSITION", linear), ("NORMAL", bent)):
                if name in row:
                    place = f"{at}.targets[{i}].{name}"
                    delta = self._document.rows(row[name], place, "VEC3")
                    if len(delta) != len(linear):
                        raise self._document.fail(
                            place, f"{len(linear)} rows were expected, found {len(delta)}"
                        )
                    made[name] = np.einsum("vij,vj->vi", moved, delta).astype("<f4")
            out.append(made or {"POSITION": np.zeros((len(linear), 3), "<f4")})
        return out


class _Lists:
    """Reads the attributes and triangles of a primitive, whether or not Draco compressed them."""

    def __init__(self, document: Document, primitive: Mapping[str, Any], at: str) -> None:
        self._document, self._primitive, self._at = document, primitive, at
        extensions = primitive.get("extensions")
        table = extensions.get(DRACO) if isinstance(extensions, dict) else None
        self._packed = document.draco(table, at) if isinstance(table, dict) else None
        numbers = table.get("attributes") if isinstance(table, dict) else None
        self._numbers: Mapping[str, Any] = numbers if isinstance(numbers, dict) else {}

    def rows(self, name: str, at: str) -> Doubles:
        """float64[V, n], the values of an attribute."""
        document, index = self._document, self._primitive["attributes"][name]
        accessor = document.item("accessors", index, at)
        kind = accessor.get("type")
        own = _KINDS.get(name)
        if kind not in ("VEC2", "VEC3", "VEC4") or (own and kind != own):
            raise document.fail(at, f"{own or 'VEC2 to VEC4'} was expected, found {shown(kind)}")
        if self._packed is not None and name in self._numbers:
            try:
                found = self._packed.rows(self._numbers[name])
            except GivenError as error:
                raise document.fail(at, str(error)) from None
            if found.ndim != 2 or found.shape[1] != _SIZES[kind] or not np.isfinite(found).all():
                raise document.fail(at, f"finite numbers of {kind} were expected")
            return found
        return document.rows(index, at, kind, COORDINATES)

    def indices(self, count: int) -> Ints | None:
        """int64[n], the vertex of each corner; None if the primitive has no indices."""
        if self._packed is not None:
            found = self._packed.triangles.ravel()
        elif "indices" in self._primitive:
            at = f"{self._at}.indices"
            rows = self._document.rows(self._primitive["indices"], at, "SCALAR", INDICES)
            found = rows[:, 0].astype(np.int64)
        else:
            return None
        if len(found) and not 0 <= found.min() <= found.max() < count:
            raise self._document.fail(
                f"{self._at}.indices",
                f"vertex numbers below {count} were expected, found {found.max()}",
            )
        return found


def _blended(document: Document, values: dict[str, Doubles], moves: Doubles, at: str) -> Doubles:
    """float64[V, 4, 4], per vertex the matrix from the mesh's coordinates to the scene: the mean of
    `moves` by skin weights. Normalises the weights in `values`; without weights, all vertices get
    the weight 1 on the first joint.
    """
    count = len(values["POSITION"])
    sets = [name[8:] for name in values if name.startswith("WEIGHTS_")]
    sets = [number for number in sets if f"JOINTS_{number}" in values]
    for name in [n for n in values if n.startswith(("WEIGHTS_", "JOINTS_"))]:
        if name.partition("_")[2] not in sets or values[name].shape[1] != 4:
            raise document.fail(
                f"{at}.attributes.{name}",
                "four joints and four weights for each vertex were expected",
            )
    if not sets:
        values["JOINTS_0"] = np.zeros((count, 4))
        values["WEIGHTS_0"] = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
        return np.broadcast_to(moves[0], (count, 4, 4))
    total = sum((values[f"WEIGHTS_{n}"].sum(axis=1) for n in sets), np.zeros(count))
    values["WEIGHTS_0"][total <= 0, 0] = 1.0
    total[total <= 0] = 1.0
    out = np.zeros((count, 4, 4))
    for number in sets:
        joints, weights = values[f"JOINTS_{number}"], values[f"WEIGHTS_{number}"]
        weights /= total[:, None]
        joints[weights == 0] = 0
        if joints.max(initial=0) >= len(moves) or joints.min(initial=0) < 0:
            raise document.fail(
                f"{at}.attributes.JOINTS_{number}",
                f"joints below {len(moves)} were expected, found {joints.max():.0f}",
            )
        for k in range(4):
            out += weights[:, k, None, None] * moves[joints[:, k].astype(np.int64)]
    return out


def _cofactors(linear: Doubles) -> Doubles:
    """float64[V, 3, 3], the cofactor matrices, which transform normals.

    Unlike an inverse, a cofactor matrix exists even if a matrix is singular.
    """
    a, b, c = linear[:, 0], linear[:, 1], linear[:, 2]
    out = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    return np.asarray(out * np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None])


def _unit(vectors: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 1e-20, vectors / np.maximum(length, 1e-20), [0.0, 0.0, 1.0])


def target_names(mesh: Mapping[str, Any], count: int) -> list[str]:
    """The names of a mesh's morph targets.

    Args:
        mesh: table of the mesh; extras.targetNames in it or in its first primitive has the names.
        count: number of targets; if the number of names differs, names are made up.
    """
    rows = mesh.get("primitives")
    first = rows[0] if isinstance(rows, list) and rows and isinstance(rows[0], dict) else {}
    for table in (mesh, first):
        extras = table.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list) and len(names) == count:
            return [str(name) for name in names]
    return [f"target{i}" for i in range(count)]
