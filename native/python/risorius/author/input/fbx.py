# SPDX-License-Identifier: MIT
"""Reads meshes and blend shapes of binary FBX files.

Objects, connections and properties follow Autodesk's FBX SDK (FbxMesh, FbxBlendShape,
FbxBlendShapeChannel, FbxNode's order of pivots). Axes and unit come from GlobalSettings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base import signatures
from ...base.budget import Budget
from ...base.errors import RisoriusError
from ...importing.fbx import Node, Parser, Scene, is_fbx, object_name, properties, read_scene
from ...importing.source import read_bytes
from ..geometry.skeleton import Doubles, Ints
from .obj import ObjMesh, ShapeFileError, choose_mesh, refuse_other_kinds
from .welding import welded

SUFFIX = ".fbx"
_SKIPPED = frozenset(("Video", "Texture", "Material", "Pose", "Implementation"))
_ORDERS = ("XYZ", "XZY", "YZX", "YXZ", "ZXY", "ZYX")  # RotationOrder -> axes, the first one first
_CENTIMETRE = 0.01
_DEEPEST = 64  # largest number of nodes above a mesh


def read_fbx(path: Path, mesh: str = "") -> tuple[ObjMesh, dict[str, Doubles]]:
    """Read a mesh and its blend shapes, in metres with y up.

    If a channel has several successive targets (in-betweens), the last one is used. The mesh has
    the place of its node, or of its skin in the bind pose. Vertices that exporters duplicate along
    seams of the texture are welded.

    Args:
        path: the file.
        mesh: name of the mesh' node; "": the mesh with the most vertices in blend shapes.

    Returns: the mesh, and name of a blend shape -> displacements float64[V, 3].

    Raises:
        ShapeFileError: the file is no binary FBX, has no mesh with blend shapes or none of this
            name, or the mesh is inconsistent.
        AnimationFileError: the file is damaged; the message names the place.
        BudgetError: the file contains more numbers than its size allows.
    """
    scene = open_scene(path)
    return mesh_of(scene, _choose(scene, path, mesh))


def open_scene(path: Path, skipped: frozenset[str] = _SKIPPED) -> Scene:
    """Open a binary FBX file.

    Args:
        path: the file.
        skipped: kinds of objects that are not read.

    Raises:
        ShapeFileError: the file is no binary FBX.
        AnimationFileError: the file is damaged; the message names the place.
    """
    data = read_bytes(path, found=True)
    refuse_other_kinds(path, "a binary FBX", (signatures.FBX.code,))
    if not is_fbx(data):
        raise ShapeFileError(f"{path}: a binary FBX was expected")
    return read_scene(Parser(data, str(path), Budget.of(len(data), str(path)), skipped))


def meshes_of(scene: Scene) -> list[tuple[int, str]]:
    """The object number of each mesh, and the name of its node."""
    out = []
    for number, node in scene.of_kind("Geometry").items():
        if _class_of(node) == "Mesh":
            owner = _model_of(scene, number)
            out.append((number, object_name(scene.objects[owner] if owner else node)))
    return out


def mesh_of(scene: Scene, number: int) -> tuple[ObjMesh, dict[str, Doubles]]:
    """A mesh and its blend shapes, if any, in the form of read_fbx().

    Args:
        scene: the open file.
        number: object number of the mesh, from meshes_of().

    Raises:
        ShapeFileError: the mesh is inconsistent; the message names the object.
        AnimationFileError: packed bytes are damaged; the message names the place.
    """
    geometry = scene.objects[number]
    turn = _axes(scene) @ _to_world(scene, number)
    points = _triples(scene, geometry, "Vertices")
    faces, corners = _polygons(scene, geometry, len(points))
    uvs, uv_corners = _uvs(scene, geometry, len(corners), corners)
    shapes = {
        name: _delta(scene, shape, points) @ turn[:3, :3].T
        for name, shape in _shapes(scene, number)
    }
    ends = np.cumsum([len(face) for face in faces])[:-1]
    uv_faces = [part.tolist() for part in np.split(uv_corners, ends)]
    if np.linalg.det(turn[:3, :3]) < 0:  # mirroring turns polygons inside out
        faces, uv_faces = ([row[::-1] for row in rows] for rows in (faces, uv_faces))
    found = ObjMesh(points @ turn[:3, :3].T + turn[:3, 3], uvs, faces, uv_faces)
    found, moved = welded(found, list(shapes.values()))
    return found, dict(zip(shapes, moved, strict=True))


def groups_of(scene: Scene, number: int) -> dict[str, Doubles]:
    """The vertices of a mesh by joint: name -> float64[n, 3], positions of the vertices with a
    weight above 0.5, in the space of mesh_of(). Damaged weights are left out, because only hints
    are made of the groups.

    Args:
        scene: the open file.
        number: object number of the mesh, from meshes_of().
    """
    turn = _axes(scene) @ _to_world(scene, number)
    points = _triples(scene, scene.objects[number], "Vertices") @ turn[:3, :3].T + turn[:3, 3]
    out: dict[str, Doubles] = {}
    for skin, _ in _below(scene, number, "Deformer", "Skin"):
        for cluster, node in _below(scene, skin, "Deformer", "Cluster"):
            joint = next((n for n in scene.children.get(cluster, []) if _is_model(scene, n)), 0)
            try:
                index, weights = node.array("Indexes"), node.array("Weights")
            except RisoriusError:
                continue
            if joint and len(index) == len(weights):
                own = index[weights > 0.5].astype(np.int64)
                own = own[(own >= 0) & (own < len(points))]
                if len(own):
                    out[object_name(scene.objects[joint])] = points[own]
    return out


def _choose(scene: Scene, path: Path, wanted: str) -> int:
    """Object number of the mesh with the wanted name; "": the mesh with most blend shape
    vertices."""
    found = []
    for number, node in scene.of_kind("Geometry").items():
        if _class_of(node) != "Mesh":
            continue
        size = sum(1 + shape.length("Indexes") for _, shape in _shapes(scene, number))
        if size:
            owner = _model_of(scene, number)
            found.append((number, object_name(scene.objects[owner] if owner else node), size))
    return choose_mesh(path, "blend shapes", found, wanted)


def _class_of(node: Node) -> str:
    return str(node.values[2]) if len(node.values) > 2 else ""


def _below(scene: Scene, parent: int, kind: str, tag: str) -> Iterator[tuple[int, Node]]:
    """Yields the children of an object that have this kind and class (tag), in the file's order."""
    below = scene.children.get(parent, [])
    scene.budget.work(len(below), "connections")
    for number in below:
        node = scene.objects.get(number)
        if node is not None and node.name == kind and _class_of(node) == tag:
            yield number, node


def _shapes(scene: Scene, mesh: int) -> list[tuple[str, Node]]:
    """Unique name, and target at full weight, of each blend shape channel of a mesh."""
    out: dict[str, Node] = {}
    for blend, _ in _below(scene, mesh, "Deformer", "BlendShape"):
        for channel, node in _below(scene, blend, "Deformer", "BlendShapeChannel"):
            targets = [shape for _, shape in _below(scene, channel, "Geometry", "Shape")]
            if not targets:
                continue
            full = node.array("FullWeights")
            last = int(np.argmax(full)) if full.size == len(targets) else len(targets) - 1
            name = object_name(node).rpartition(".")[2] or f"channel{len(out)}"
            while name in out:
                name += "_"
            out[name] = targets[last]
    return list(out.items())


def _numbers(scene: Scene, node: Node, name: str) -> npt.NDArray[Any]:
    found = node.array(name)
    if found.dtype.kind == "f" and not np.isfinite(found).all():
        raise _fail(scene, node, f"{name}: finite numbers were expected")
    return found


def _triples(scene: Scene, node: Node, name: str) -> Doubles:
    found = _numbers(scene, node, name)
    if found.size % 3:
        raise _fail(scene, node, f"{name}: triples were expected, found {found.size} numbers")
    return found.reshape(-1, 3).astype(np.float64)


def _fail(scene: Scene, node: Node, what: str) -> ShapeFileError:
    number = node.values[0] if node.values else ""
    return ShapeFileError(f"{scene.name}: {node.name} {object_name(node)} ({number}): {what}")


def _polygons(scene: Scene, node: Node, count: int) -> tuple[list[list[int]], Ints]:
    """The vertices of each polygon, and of all corners concatenated.

    In the file, the last corner of a polygon is stored as ~index.

    Args:
        scene: the open file.
        node: the mesh.
        count: number of vertices of the mesh.
    """
    order = _numbers(scene, node, "PolygonVertexIndex").astype(np.int64)
    last = order < 0
    corners = np.where(last, ~order, order)
    if not corners.size or not last[-1] or corners.max() >= count:
        raise _fail(scene, node, f"PolygonVertexIndex: polygons of {count} vertices were expected")
    parts = np.split(corners, np.flatnonzero(last)[:-1] + 1)
    return [part.tolist() for part in parts], corners


def _uvs(scene: Scene, node: Node, count: int, corners: Ints) -> tuple[Doubles, Ints]:
    """The first UV layer of a mesh, and for each corner its index in the layer; zeros if
    missing.

    Args:
        scene: the open file.
        node: the mesh.
        count: number of polygon corners of the mesh.
        corners: int64[count], vertex of each corner.
    """
    layer = node.first("LayerElementUV")
    if layer is None:
        return np.zeros((1, 2)), np.zeros(count, np.int64)
    uvs = _numbers(scene, layer, "UV").astype(np.float64)
    uvs = uvs[: uvs.size // 2 * 2].reshape(-1, 2)
    by_vertex = _word(layer, "MappingInformationType") in ("ByVertice", "ByVertex")
    order = corners if by_vertex else np.arange(count)
    if _word(layer, "ReferenceInformationType") != "Direct":
        index = _numbers(scene, layer, "UVIndex").astype(np.int64)
        if index.size <= order.max():
            what = f"UVIndex: {order.max() + 1} were expected, found {index.size}"
            raise _fail(scene, node, what)
        order = index[order]
    if not (order.min() >= 0 and order.max() < len(uvs)):
        raise _fail(scene, node, f"UVIndex: indices below {len(uvs)} were expected")
    return uvs, order


def _word(node: Node, name: str) -> str:
    found = node.first(name)
    return str(found.values[0]) if found is not None and found.values else ""


def _delta(scene: Scene, shape: Node, points: Doubles) -> Doubles:
    index = _numbers(scene, shape, "Indexes").astype(np.int64)
    moved = _triples(scene, shape, "Vertices")
    if len(moved) != len(index):
        raise _fail(scene, shape, f"{len(index)} vertices were expected, found {len(moved)}")
    if index.size and not 0 <= index.min() <= index.max() < len(points):
        raise _fail(
            scene,
            shape,
            f"Indexes below {len(points)} were expected, found {index.min()} to {index.max()}",
        )
    scene.budget.hold(points.nbytes, object_name(shape))
    out = np.zeros_like(points)
    out[index] = moved
    return out


def _axes(scene: Scene) -> Doubles:
    """float64[4, 4]: matrix from the scene's axes and unit to metres with y up."""
    rows = {name: values[-1] for name, values in properties(scene.settings).items()}

    def axis(name: str, default: int) -> Doubles:
        at, sign = rows.get(f"{name}Axis", default), rows.get(f"{name}AxisSign", 1)
        if at not in (0, 1, 2) or sign not in (1, -1):
            raise ShapeFileError(
                f"{scene.name}: GlobalSettings: {name}Axis of 0, 1 or 2 with sign 1 or -1 expected"
            )
        out = np.zeros(3)
        out[at] = sign
        return out

    turn = np.stack([axis("Coord", 0), axis("Up", 1), axis("Front", 2)])
    if abs(np.linalg.det(turn)) < 0.5:
        raise ShapeFileError(f"{scene.name}: GlobalSettings: three different axes were expected")
    unit = rows.get("UnitScaleFactor", 1.0)
    if not isinstance(unit, int | float) or not 0 < unit < 1e9:
        raise ShapeFileError(f"{scene.name}: GlobalSettings: UnitScaleFactor above 0 expected")
    out = np.eye(4)
    out[:3, :3] = turn * float(unit) * _CENTIMETRE
    return out


def _model_of(scene: Scene, number: int) -> int:
    """Object number of an object's parent node; 0 if there is none."""
    for parent, way in scene.parents.get(number, []):
        node = scene.objects.get(parent)
        if node is not None and node.name == "Model" and not way:
            return parent
    return 0


def _to_world(scene: Scene, mesh: int) -> Doubles:
    """float64[4, 4]: matrix from a mesh to the world, by its nodes or its skin; column vectors."""
    at = _model_of(scene, mesh)
    out = _geometric(scene, scene.objects[at]) if at else np.eye(4)
    joint = _top_joint(scene, mesh)
    if joint is None:
        return _product(scene, _chain(scene, at)) @ out
    stands, place = joint
    return _product(scene, stands) @ place @ out


def _chain(scene: Scene, node: int) -> list[int]:
    """A node and its ancestors, the root last."""
    out: list[int] = []
    while node and len(out) < _DEEPEST:
        out.append(node)
        node = _model_of(scene, node)
    return out


def _product(scene: Scene, chain: Sequence[int]) -> Doubles:
    """float64[4, 4]: matrix from the first node of a chain to the world."""
    out = np.eye(4)
    for node in chain:
        out = _local(scene, scene.objects[node]) @ out
    return out


def _top_joint(scene: Scene, mesh: int) -> tuple[list[int], Doubles] | None:
    """The joint nearest to the root among the joints of a mesh' skin; it places the mesh.

    This joint is used because the mesh' node and other joints may be posed.

    Returns: the joint with its ancestors, and the matrix float64[4, 4] from the mesh to the joint
        in the bind pose; None if no skin of the mesh states this matrix.
    """
    found: tuple[list[int], Node] | None = None
    for skin, _ in _below(scene, mesh, "Deformer", "Skin"):
        for cluster, node in _below(scene, skin, "Deformer", "Cluster"):
            joints = [n for n in scene.children.get(cluster, []) if _is_model(scene, n)]
            if node.length("Transform") != 16 or not joints:
                continue
            chain = _chain(scene, joints[0])
            scene.budget.work(len(chain), "joints")
            if found is None or len(chain) < len(found[0]):
                found = chain, node
    if found is None:
        return None
    place = _numbers(scene, found[1], "Transform")
    return found[0], place.reshape(4, 4).T.astype(np.float64)


def _is_model(scene: Scene, number: int) -> bool:
    node = scene.objects.get(number)
    return node is not None and node.name == "Model"


def _geometric(scene: Scene, node: Node) -> Doubles:
    """The geometric transform of a node, which moves its mesh but not its children."""
    read = _Transforms(scene, node)
    return (
        read.shift("GeometricTranslation")
        @ read.turn("GeometricRotation")
        @ read.size("GeometricScaling")
    )


def _local(scene: Scene, node: Node) -> Doubles:
    """A node's local matrix T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1 of the SDK's manual."""
    read = _Transforms(scene, node)
    pivot, scaled = read.shift("RotationPivot"), read.shift("ScalingPivot")
    turned = read.turn("PreRotation") @ read.turn("Lcl Rotation", read.order())
    turned = turned @ read.turn("PostRotation").T
    out = read.shift("Lcl Translation") @ read.shift("RotationOffset")
    out = out @ pivot @ turned @ _back(pivot)
    sized = scaled @ read.size("Lcl Scaling") @ _back(scaled)
    return out @ read.shift("ScalingOffset") @ sized


def _back(shift: Doubles) -> Doubles:
    """The inverse of a translation matrix, without LAPACK, whose threads take milliseconds."""
    out = shift.copy()
    out[:3, 3] *= -1
    return out


class _Transforms:
    """Makes transformation matrices from the properties of an FBX node."""

    def __init__(self, scene: Scene, node: Node) -> None:
        self._scene, self._node = scene, node
        self._rows = properties(node)

    def _three(self, name: str, default: float) -> Doubles:
        values: Sequence[Any] = self._rows.get(name, [default] * 3)
        good = len(values) == 3 and all(isinstance(v, int | float) for v in values)
        out = np.array(values if good else [np.nan] * 3, np.float64)
        if not np.isfinite(out).all():
            raise _fail(self._scene, self._node, f"{name}: three numbers were expected")
        return out

    def order(self) -> str:
        """The axes in the order in which a rotation is applied, such as XYZ: first about x."""
        number = self._rows.get("RotationOrder", [0])[-1]
        if not isinstance(number, int) or not 0 <= number < len(_ORDERS):
            raise _fail(
                self._scene, self._node, f"RotationOrder: 0 to {len(_ORDERS) - 1} was expected"
            )
        return _ORDERS[number]

    def shift(self, name: str) -> Doubles:
        out = np.eye(4)
        out[:3, 3] = self._three(name, 0.0)
        return out

    def size(self, name: str) -> Doubles:
        return np.diag([*self._three(name, 1.0), 1.0])

    def turn(self, name: str, order: str = "XYZ") -> Doubles:
        """float64[4, 4]: the matrix of a rotation.

        Args:
            name: name of the property with the three angles in degrees.
            order: the axes in the order in which the node is rotated about them. The axes stay
                fixed: they do not rotate with the node.
        """
        angles = np.radians(self._three(name, 0.0))
        out = np.eye(4)
        for letter in order:
            axis = "XYZ".index(letter)
            a, b = (axis + 1) % 3, (axis + 2) % 3
            one = np.eye(4)
            one[a, a] = one[b, b] = np.cos(angles[axis])
            one[b, a] = np.sin(angles[axis])
            one[a, b] = -one[b, a]
            out = one @ out
        return out
