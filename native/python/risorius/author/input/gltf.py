# SPDX-License-Identifier: MIT
"""Reads meshes and morph targets of glTF and GLB files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base import signatures
from ...base.budget import Budget
from ...base.errors import RisoriusError
from ...base.given import GivenError, shown
from ...importing import named_json
from ...importing.gltf import FLOATS, INDICES, Document, is_glb, is_gltf, open_glb, open_gltf
from ...importing.packed.draco import EXTENSION as DRACO
from ...importing.source import decode, read_bytes
from ..geometry.skeleton import Doubles, Ints
from .obj import ObjMesh, ShapeFileError, choose_mesh, refuse_other_kinds
from .welding import welded

SUFFIXES = (".glb", ".gltf", ".vrm")  # VRM is a GLB with named bones of a body
_TRIANGLES = 4
_DEEPEST = 1024  # largest number of nodes above a mesh
_CORNER_BYTES = 48  # memory of a triangle's corner in arrays and lists
_FURTHEST_UV = 1e6


def read_gltf(path: Path, mesh: str = "") -> tuple[ObjMesh, dict[str, Doubles]]:
    """Read a mesh of triangles and its morph targets, in metres with y up.

    The mesh has the place of its node, or of its skin in the bind pose. Vertices that a glTF
    duplicates along seams of the texture or of the normals are welded.

    Args:
        path: the file.
        mesh: name of the mesh; "": the mesh with the most vertices in morph targets.

    Returns: the mesh, and name of a morph target -> displacements float64[V, 3].

    Raises:
        ShapeFileError: the file is no glTF, or has no mesh with morph targets or none of this name.
        AnimationFileError: the file is damaged, or the mesh is not made of lists of triangles; the
            message names the place.
        BudgetError: the file contains more numbers than its size allows.
    """
    document = open_document(path)
    mesh_number = _choose(document, path, mesh)
    found, shapes = assembled(document, mesh_number)
    if not found.faces:
        raise document.fail(f"meshes[{mesh_number}]", "triangles were expected, found none")
    return found, shapes


def open_document(path: Path) -> Document:
    """Open a glTF or GLB file.

    Args:
        path: the file.

    Raises:
        ShapeFileError: the file is no glTF.
        AnimationFileError: the file is damaged; the message names the place.
    """
    data = read_bytes(path, found=True)
    refuse_other_kinds(path, "a glTF", (signatures.GLB.code,))
    budget = Budget.of(len(data), str(path))
    if is_glb(data):
        return open_glb(path, data, budget)
    json = named_json.parse(decode(data, str(path)), str(path))
    if not is_gltf(json):
        raise ShapeFileError(f"{path}: a glTF was expected")
    return open_gltf(path, json, budget=budget)


def _choose(document: Document, path: Path, wanted: str) -> int:
    """Index of the mesh with the wanted name; "": the mesh with the most morph target vertices."""
    rows = document.json.get("meshes")
    found = []
    for number, row in enumerate(rows if isinstance(rows, list) else []):
        size = sum(_targets(p) * _vertices(document, p) for p in primitives(document, row, number))
        if size:
            found.append((number, name_of(document, row, number), size))
    return choose_mesh(path, "morph targets", found, wanted)


def name_of(document: Document, row: Mapping[str, Any], number: int) -> str:
    """The name of a mesh, or of the nearest named node above it, because packers drop mesh names.

    Args:
        document: the open file.
        row: the JSON object of the mesh.
        number: index of the mesh.
    """
    world = _World(document)
    node = world.of_mesh(number)
    names = [row, *(world.rows[n] for n in (world.above(node) if node >= 0 else ()))]
    found = (named.get("name") for named in names)
    return next((name for name in found if isinstance(name, str) and name), f"mesh{number}")


def primitives(document: Document, row: object, number: int) -> list[dict[str, Any]]:
    """The primitives of a mesh.

    Args:
        document: the open file.
        row: the JSON object of the mesh.
        number: index of the mesh, for error messages.

    Raises:
        AnimationFileError: the mesh has no list of primitives.
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
    """A mesh and its morph targets in the form of read_gltf(); both may be empty.

    Args:
        document: the open file.
        number: index of the mesh.

    Raises:
        AnimationFileError: the mesh is damaged; the message names the place.
    """
    row = document.json["meshes"][number]
    place = f"meshes[{number}]"
    parts: list[_Part] = []
    begins: dict[str, int] = {}  # attributes -> first vertex; primitives may share vertices
    triangles = []
    total = 0
    for i, primitive in enumerate(primitives(document, row, number)):
        at = f"{place}.primitives[{i}]"
        key = repr([primitive.get(name) for name in ("attributes", "targets", "extensions")])
        if key not in begins:
            begins[key] = total
            parts.append(_Part(document, primitive, at))
            total += len(parts[-1].positions)
        part = parts[list(begins).index(key)]
        triangles.append(part.triangles(document, primitive, at) + begins[key])
    counts = {len(part.deltas) for part in parts}
    if len(counts) != 1:
        raise document.fail(
            place,
            (
                "as many morph targets in all primitives as in the first were expected, found "
                f"{sorted(counts)}"
            ),
        )
    names = _names(row, counts.pop())
    corners = np.concatenate(triangles)
    # Leave out triangles with a repeated vertex.
    corners = corners[(np.diff(np.sort(corners, axis=1), axis=1) > 0).all(axis=1)]
    used, order = np.unique(corners, return_inverse=True)
    corners = order.reshape(-1, 3)
    turn = _node_matrix(document, number)
    size = turn[:3, :3]
    if np.linalg.det(size) < 0:  # mirroring turns polygons inside out
        corners = corners[:, ::-1]
    points = np.concatenate([part.positions for part in parts])[used]
    uvs = np.concatenate([part.uvs for part in parts])[used]
    deltas = [
        np.concatenate(d)[used] @ size.T for d in zip(*(p.deltas for p in parts), strict=True)
    ]
    faces = corners.tolist()
    mesh = ObjMesh(points @ size.T + turn[:3, 3], uvs, faces, faces)
    mesh, moved = welded(mesh, deltas, all_polygons=False)
    return mesh, dict(zip(names, moved, strict=True))


def groups_of(document: Document, number: int) -> dict[str, Doubles]:
    """The vertices of a skinned mesh by joint: name -> float64[n, 3], positions of the vertices
    with a weight above 0.5, in the space of assembled(). Empty without a skin, for weights that are
    compressed by Draco, and for damaged weights, because only hints are made of the groups.

    Args:
        document: the open file.
        number: index of the mesh.
    """
    world = _World(document)
    node = world.of_mesh(number)
    if node < 0 or "skin" not in world.rows[node]:
        return {}
    try:
        joints = document.item("skins", world.rows[node]["skin"], "skin")["joints"]
        names = [str(world.rows[joint].get("name") or "") for joint in joints]
        turn, out = _node_matrix(document, number), dict[str, list[Doubles]]()
        row = document.json["meshes"][number]
        own = {repr(p.get("attributes")): p for p in primitives(document, row, number)}
        for primitive in own.values():  # primitives may share vertices
            for joint, points in _held(document, primitive, f"meshes[{number}]"):
                out.setdefault(names[joint], []).append(points @ turn[:3, :3].T + turn[:3, 3])
    except (RisoriusError, LookupError, TypeError):
        return {}
    return {name: np.concatenate(rows) for name, rows in out.items()}


def _held(
    document: Document, primitive: Mapping[str, Any], place: str
) -> Iterator[tuple[int, Doubles]]:
    """Yields for each joint of a primitive its index in the skin, and the positions of the vertices
    with a weight above 0.5."""
    given = primitive["attributes"]
    points = _Packed(document, primitive, place).rows(given, "POSITION", "VEC3")
    joints = document.rows(given["JOINTS_0"], place, "VEC4", INDICES).astype(np.int64)
    weights = document.rows(given["WEIGHTS_0"], place, "VEC4")
    most = weights.argmax(axis=1)
    every = np.arange(len(points))
    held = np.where(weights[every, most] > 0.5, joints[every, most], -1)
    for joint in np.unique(held[held >= 0]):
        yield int(joint), points[held == joint]


class _Part:
    """The vertices of a glTF primitive. Several primitives of a mesh may share these vertices."""

    def __init__(self, document: Document, primitive: Mapping[str, Any], place: str) -> None:
        attributes = primitive.get("attributes")
        given = attributes if isinstance(attributes, dict) else {}
        self._packed = packed = _Packed(document, primitive, place)
        self.positions = packed.rows(given, "POSITION", "VEC3")
        count = len(self.positions)
        self.uvs = _uvs(document, primitive, packed, given, count)
        targets = primitive.get("targets")
        self.deltas = [
            self._delta(document, target, f"{place}.targets[{i}]", count)
            for i, target in enumerate(targets if isinstance(targets, list) else [])
        ]

    def triangles(self, document: Document, primitive: Mapping[str, Any], place: str) -> Ints:
        """int64[n, 3]: the triangles of a primitive with these vertices.

        Raises:
            AnimationFileError: the primitive is damaged or has no triangles.
        """
        if document.whole(primitive, "mode", place, _TRIANGLES) != _TRIANGLES:
            raise document.fail(f"{place}.mode", "triangles were expected")
        count, at = len(self.positions), f"{place}.indices"
        order: Ints = np.arange(count)
        if self._packed.mesh is not None:
            order = self._packed.mesh.triangles.ravel()
        elif "indices" in primitive:
            rows = document.rows(primitive["indices"], at, "SCALAR", INDICES)
            order = rows[:, 0].astype(np.int64)
        document.budget.hold(len(order) * _CORNER_BYTES, at)
        if len(order) % 3 or (len(order) and not 0 <= order.min() <= order.max() < count):
            raise document.fail(at, f"triangles of {count} vertices were expected")
        return order.reshape(-1, 3)

    @staticmethod
    def _delta(document: Document, target: object, place: str, count: int) -> Doubles:
        if not isinstance(target, dict):
            raise document.fail(place, f"a table was expected, found {shown(target)}")
        if "POSITION" not in target:
            return np.zeros((count, 3))
        delta = document.rows(target["POSITION"], place, "VEC3")
        if len(delta) != count:
            raise document.fail(place, f"{count} rows were expected, found {len(delta)}")
        return delta


class _Packed:
    """Reads the attributes of a primitive, with or without Draco compression."""

    def __init__(self, document: Document, primitive: Mapping[str, Any], place: str) -> None:
        self._document, self._place = document, place
        extensions = primitive.get("extensions")
        table = extensions.get(DRACO) if isinstance(extensions, dict) else None
        self.mesh, self._numbers = None, {}
        if isinstance(table, dict):
            self.mesh = document.draco(table, place)
            numbers = table.get("attributes")
            self._numbers = numbers if isinstance(numbers, dict) else {}

    def rows(self, given: Mapping[str, Any], name: str, kind: str) -> Doubles:
        """float64[V, n]: the values of an attribute.

        Raises:
            AnimationFileError: the attribute is missing or has another type or length.
        """
        at = f"{self._place}.attributes.{name}"
        if self.mesh is None or name not in self._numbers:
            accessor = self._document.item("accessors", given.get(name), at)
            if "bufferView" not in accessor and "sparse" not in accessor:
                needed = self._document.json.get("extensionsRequired")
                why = f"; the file requires {_listed(needed)}" if needed else ""
                raise self._document.fail(at, f"a bufferView was expected, found none{why}")
            return self._document.rows(given.get(name), at, kind)
        accessor = self._document.item("accessors", given.get(name), at)
        try:
            found = self.mesh.rows(self._numbers[name])
        except GivenError as error:
            raise self._document.fail(at, str(error)) from None
        count = self._document.whole(accessor, "count", f"accessors[{given.get(name)}]")
        shape = (count, {"VEC2": 2, "VEC3": 3}[kind])
        if found.shape != shape:
            raise self._document.fail(
                at, f"{shape[0]} rows of {shape[1]} numbers were expected, found {found.shape}"
            )
        if not np.isfinite(found).all():
            raise self._document.fail(at, "finite numbers were expected")
        return found


def _listed(names: object) -> str:
    return ", ".join(str(n)[:60] for n in names[:4]) if isinstance(names, list) else shown(names)


def _uvs(
    document: Document,
    primitive: Mapping[str, Any],
    packed: _Packed,
    given: Mapping[str, Any],
    count: int,
) -> Doubles:
    """float64[V, 2]: texture coordinates of the colour texture, v up; zeros if there are none.

    Args:
        document: the open file.
        primitive: the primitive, with the number of its material.
        packed: reads the attributes.
        given: the attributes of the primitive: name -> accessor.
        count: number of vertices of the primitive.
    """
    texture = _texture(document, primitive)
    extensions = texture.get("extensions")
    change = extensions.get("KHR_texture_transform") if isinstance(extensions, dict) else None
    change = change if isinstance(change, dict) else {}
    wanted = change.get("texCoord", texture.get("texCoord", 0))
    name = next((n for n in (f"TEXCOORD_{wanted}", "TEXCOORD_0") if n in given), "")
    if not name:
        return np.zeros((count, 2))
    found = packed.rows(given, name, "VEC2")
    if len(found) != count:
        raise document.fail(
            f"primitives.attributes.{name}", f"{count} rows were expected, found {len(found)}"
        )
    place = "KHR_texture_transform"
    found = found * document.finite(change, "scale", [1.0, 1.0], place)
    angle = document.finite({"rotation": [change.get("rotation", 0)]}, "rotation", [0], place)
    cos, sin = float(np.cos(angle[0])), float(np.sin(angle[0]))
    found = found @ np.array([[cos, -sin], [sin, cos]])
    found = found + document.finite(change, "offset", [0.0, 0.0], place)
    if not np.abs(found).max(initial=0.0) <= _FURTHEST_UV:
        raise document.fail(
            f"primitives.attributes.{name}",
            f"texture coordinates up to {_FURTHEST_UV:g} were expected, found "
            f"{np.abs(found).max():g}",
        )
    return np.stack([found[:, 0], 1 - found[:, 1]], axis=1)  # v points down in glTF


def _texture(document: Document, primitive: Mapping[str, Any]) -> Mapping[str, Any]:
    """The JSON object of the colour texture of a primitive's material; empty if there is none."""
    if "material" not in primitive:
        return {}
    material = document.item("materials", primitive["material"], "primitives.material")
    colour = material.get("pbrMetallicRoughness")
    texture = colour.get("baseColorTexture") if isinstance(colour, dict) else None
    return texture if isinstance(texture, dict) else {}


def _names(row: Mapping[str, Any], count: int) -> list[str]:
    """Unique names of the morph targets: the names in extras.targetNames; "target0" and so on if
    the mesh has no such list or a list of another length."""
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


def _node_matrix(document: Document, mesh: int) -> Doubles:
    """float64[4, 4]: matrix from a mesh to the world.

    The result is the matrix of the first node with the mesh. If this node has a skin, the bind pose
    determines the matrix instead. The result is the identity if no node has the mesh.
    """
    world = _World(document)
    found = world.of_mesh(mesh)
    if found < 0:
        return np.eye(4)
    if "skin" in world.rows[found]:
        return _bound(document, world, world.rows[found]["skin"], f"nodes[{found}].skin")
    return world.matrix(found)


def world_matrix(document: Document, node: int) -> Doubles:
    """float64[4, 4]: matrix from a node to the world; the identity for a negative index.

    Args:
        document: the open file.
        node: index of the node.

    Raises:
        AnimationFileError: the node is its own ancestor, or a transform is invalid.
    """
    return _World(document).matrix(node) if node >= 0 else np.eye(4)


class _World:
    """The hierarchy of the nodes and their world matrices."""

    def __init__(self, document: Document) -> None:
        self._document = document
        nodes = document.json.get("nodes")
        self.rows: list[dict[str, Any]] = nodes if isinstance(nodes, list) else []
        document.budget.work(len(self.rows), "nodes")
        self._parents: dict[int, int] = {}
        for number, node in enumerate(self.rows):
            if not isinstance(node, dict):
                raise document.fail(
                    f"nodes[{number}]", f"a table was expected, found {shown(node)}"
                )
            children = node.get("children")
            for child in children if isinstance(children, list) else []:
                if isinstance(child, int):
                    self._parents[child] = number

    def of_mesh(self, mesh: int) -> int:
        """Index of the first node that shows the mesh; -1 if no node shows it."""
        return next((n for n, row in enumerate(self.rows) if row.get("mesh") == mesh), -1)

    def above(self, node: int) -> list[int]:
        """A node and its ancestors, the root last. Raises AnimationFileError for a cycle."""
        out = [node]
        while out[-1] in self._parents:
            out.append(self._parents[out[-1]])
            if len(out) > _DEEPEST:
                what = f"it hangs on itself, or below more than {_DEEPEST} nodes"
                raise self._document.fail(f"nodes[{node}]", what)
        return out

    def matrix(self, node: int) -> Doubles:
        """float64[4, 4]: matrix from a node to the world."""
        out = np.eye(4)
        for number in self.above(node):
            out = self._document.transform(self.rows[number], f"nodes[{number}]") @ out
        return out


def _bound(document: Document, world: _World, index: object, place: str) -> Doubles:
    """float64[4, 4]: matrix from a skinned mesh in its bind pose to the world.

    The joint nearest to the root determines the matrix, because other joints may be posed. glTF
    ignores the node of a skinned mesh.
    """
    skin = document.item("skins", index, place)
    joints, at = skin.get("joints"), f"skins[{index}]"
    if not isinstance(joints, list) or not joints:
        raise document.fail(f"{at}.joints", f"nodes were expected, found {shown(joints)}")
    for joint in joints:
        document.item("nodes", joint, f"{at}.joints")
    top = min(range(len(joints)), key=lambda j: len(world.above(joints[j])))
    out = world.matrix(joints[top])
    if "inverseBindMatrices" not in skin:
        return out
    rows = document.rows(skin["inverseBindMatrices"], f"{at}.inverseBindMatrices", "MAT4", FLOATS)
    if len(rows) < len(joints):
        raise document.fail(
            f"{at}.inverseBindMatrices", f"{len(joints)} were expected, found {len(rows)}"
        )
    return out @ rows[top].reshape(4, 4).T
