# SPDX-License-Identifier: MIT
"""Makes a face of blend shapes from a mesh and its expressions; joint_rig makes a rig from it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ... import BlendShapeChannels, BlendShapeTarget, Dna, JointGroup, Mesh
from ...base.easing import smooth_step
from ...base.errors import ArgumentError
from ...rigs.rotation import Convention
from ..geometry import skeleton as sk
from ..geometry.polygon_mesh import polygon_mesh, vertex_normals
from ..geometry.skeleton import FARTHEST, Doubles
from ..geometry.sparse import subset
from ..heads.joining import FacePart, Joined
from ..heads.turning import Turn
from .matching import PREFIX
from .obj import ObjMesh, ShapeFileError

_LIP = re.compile(r"([UD])[LR]$")
# Control, expression, and the control's fraction of the expression: float64[V, 1] or one number.
_Delta = tuple[str, str, Doubles | float]
_LEAST = 1e-6  # in sizes of the mesh; a vertex that moves less counts as resting


@dataclass
class ShapeSet:
    """A joined mesh (y is up) and its expressions, in one unit; `parts` are the original meshes."""

    name: str
    mesh: ObjMesh
    # name of an expression -> float64[V, 3], displacements of the vertices of `mesh`
    expressions: MutableMapping[str, Doubles] = field(default_factory=dict)
    left: int = 1  # the character's left is +x (1) or -x (-1)
    unit: str = "cm"
    parts: list[FacePart] = field(default_factory=list)  # meshes of the face, as ranges of `mesh`
    turns: list[Turn] = field(default_factory=list)  # joints of eyes and jaw
    notes: list[str] = field(default_factory=list)  # sentences on guesses

    @property
    def kept(self) -> tuple[str, ...]:
        """Beginnings of the names of meshes that follow only the joint of an eye."""
        return tuple(f"{p.name}_lod" for p in self.parts if p.joint.endswith("_Eye"))


def shape_set(name: str, head: Joined) -> ShapeSet:
    """The ShapeSet of a joined head.

    Args:
        name: name of the face.
        head: the joined head.
    """
    return ShapeSet(
        name,
        head.mesh,
        head.shapes,
        head.left,
        head.unit,
        head.parts,
        head.turns,
        head.notes,
    )


def check_shapes(shapes: ShapeSet, go_on: Callable[[], object] = lambda: None) -> list[str]:
    """Check expressions. Returns sentences on unusual ones, which are no errors.

    Args:
        shapes: the mesh and its expressions.
        go_on: called before each expression; an exception that it raises stops the work.

    Raises:
        ArgumentError: coordinates are too large, all vertices are in one point, an expression has
            another number of vertices, or no expression moves a vertex.
    """
    size = float(np.ptp(shapes.mesh.positions, axis=0).max())
    if not np.abs(shapes.mesh.positions).max(initial=0.0) <= FARTHEST:
        raise ArgumentError(_too_large("the neutral mesh", shapes.mesh.positions))
    if not size:
        raise ArgumentError(
            "the neutral mesh: some size was expected, found all vertices at one point"
        )
    notes: list[str] = []
    seen: dict[bytes, str] = {}
    moving = 0
    for name, delta in shapes.expressions.items():
        go_on()
        if not np.abs(delta).max(initial=0.0) <= FARTHEST:
            raise ArgumentError(_too_large(name, delta))
        if delta.shape != shapes.mesh.positions.shape:
            raise ArgumentError(
                f"expression {name}: {len(shapes.mesh.positions):,} vertices were expected, "
                f"found {len(delta):,}"
            )
        length = np.linalg.norm(delta, axis=1)
        if length.max() <= _LEAST * size:
            notes.append(f"{name} moves nothing")
            continue
        moving += 1
        mean = delta.mean(axis=0)
        if np.linalg.norm(delta - mean, axis=1).max() < 0.02 * np.linalg.norm(mean):
            notes.append(f"{name} moves the whole mesh: is another neutral baked into it?")
        elif length.mean() > 0.25 * size:
            notes.append(f"{name} is far from the neutral mesh: another unit or other axes?")
        key = _key(delta, length, size)
        if key in seen:
            notes.append(f"{name} is the same as {seen[key]}")
        seen.setdefault(key, name)
    if not moving:
        raise ArgumentError("no expression moves a vertex of the neutral mesh")
    return notes


def _too_large(name: str, points: Doubles) -> str:
    return f"{name}: coordinates up to {FARTHEST:g} were expected, found {np.abs(points).max():g}"


def _key(delta: Doubles, length: Doubles, size: float) -> bytes:
    """Bytes that are equal for shapes that are equal to six decimals of the mesh' size.

    Args:
        delta: float64[V, 3].
        length: float64[V], lengths of the displacements.
        size: size of the mesh.
    """
    rows = np.flatnonzero(length > 0.4e-6 * size)
    even = np.round(delta[rows] / size, 6) + 0.0  # without the sign of -0.0
    moved = even.any(axis=1)
    return hashlib.sha256(rows[moved].tobytes() + even[moved].tobytes()).digest()


def take_combined(shapes: ShapeSet) -> MutableMapping[str, Doubles]:
    """Remove and return the sculpts of combined expressions, which are named like smile+jawOpen.

    Args:
        shapes: the mesh and its expressions; it is changed.
    """
    out = subset(shapes.expressions, [name for name in shapes.expressions if "+" in name])
    for name in out:
        del shapes.expressions[name]
    return out


def combined_rows(
    where: str,
    shapes: ShapeSet,
    together: Mapping[str, Doubles],
    controls: Mapping[str, Sequence[str]],
    raw: Sequence[str],
) -> list[tuple[tuple[int, ...], Doubles]]:
    """Convert sculpts of combined expressions to correctives.

    Args:
        where: name of the file in error messages.
        shapes: the mesh and its single expressions.
        together: result of take_combined().
        controls: expression -> raw controls without prefix.
        raw: names of all raw controls.

    Returns: for each sculpt, the indices of its raw controls, and its displacements float64[V, 3]
        without the displacements of its single expressions and of its smaller combinations. A
        sculpt with a left-out expression has no entry.

    Raises:
        ShapeFileError: a combination names an unknown expression.
    """
    out: list[tuple[tuple[int, ...], Doubles]] = []
    used: list[frozenset[str]] = []
    for name in sorted(together, key=lambda n: (n.count("+"), n)):
        parts = frozenset(part.strip() for part in name.split("+"))
        for part in sorted(parts):
            if part not in controls:
                known = ", ".join(sorted(controls))
                raise ShapeFileError(
                    f"{where}: combination {name}: one of {known} was expected, found {part!r}"
                )
        if any(not controls[part] for part in parts):
            continue  # an expression of the combination is left out
        delta = together[name] - sum(shapes.expressions[part] for part in parts)
        for smaller, (_, part_delta) in zip(used, out, strict=True):
            if smaller < parts:
                delta = delta - part_delta
        named = {c for part in parts for c in controls[part]}
        numbers = sorted(i for i, full in enumerate(raw) if full.removeprefix(PREFIX) in named)
        used.append(parts)
        out.append((tuple(numbers), delta))
    return out


def make_shape_face(
    shapes: ShapeSet,
    controls: Mapping[str, Sequence[str]],
    go_on: Callable[[], object] = lambda: None,
) -> Dna:
    """Make a Dna with a mesh for each part and a blend shape for each control of an expression.

    The joints are root and head, and eyes and jaw if `shapes` has joints for them. Controls that
    only turn these joints have no blend shape.

    Args:
        shapes: the mesh and its expressions.
        controls: expression -> raw controls without prefix, from matching.assign(). If there are
            several, the expression is divided among them, so that their sum is the expression:
            controls of a side or a lip get that side or lip with a soft edge, other controls equal
            parts. An expression without controls is left out.
        go_on: called before each control; an exception that it raises stops the work.

    Raises:
        ArgumentError: all expressions are left out.
    """
    parts = shapes.parts or [
        FacePart("", 0, len(shapes.mesh.positions), (0, len(shapes.mesh.faces)), "head")
    ]
    positions = shapes.mesh.positions[: parts[0].stop]
    deltas = _by_control(shapes, controls)
    names = [name for name, _, _ in deltas]
    if not deltas:
        raise ArgumentError(
            "at least one expression that becomes a control was expected: all are left out"
        )
    dna = Dna()
    dna.name, dna.db_name = shapes.name, "risorius"
    dna.archetype, dna.gender = "other", "other"
    dna.coordinate_system = ("right", "up", "front")
    dna.translation_unit = shapes.unit
    dna.lod_count = 1
    low, high = positions.min(axis=0), positions.max(axis=0)
    head = np.array([0.0, low[1] + 0.4 * (high[1] - low[1]), 0.4 * low[2] + 0.6 * high[2]])
    dna.joint_names = ["root", "head", *(turn.name for turn in shapes.turns)]
    dna.joint_parents = [0, 0, *(1 for _ in shapes.turns)]
    dna.neutral_joint_translations = np.array(
        [np.zeros(3), head, *(turn.position - head for turn in shapes.turns)]
    )
    dna.neutral_joint_rotations = np.zeros((len(dna.joint_names), 3))
    by_joints = dict.fromkeys(c for turn in shapes.turns for c in turn.motions if c not in names)
    dna.raw_control_names = [PREFIX + name for name in (*names, *by_joints)]
    dna.blend_shape_channel_names = names
    count, columns = len(names), len(names) + len(by_joints)
    dna.blend_shape_channels = BlendShapeChannels(
        lods=[count], input_indices=range(count), output_indices=range(count)
    )
    dna.joint_row_count, dna.joint_column_count = 9 * len(dna.joint_names), columns
    if shapes.turns:
        dna.joint_groups = _turning(dna, shapes.turns)
    _add_meshes(dna, shapes, parts, deltas, go_on)
    dna.lod_joint_mapping = [list(range(len(dna.joint_names)))]
    dna.lod_blend_shape_mapping = [range(count)]
    return dna


def _turning(dna: Dna, turns: Sequence[Turn]) -> list[JointGroup]:
    """The joint groups that turn the joints of eyes and jaw."""
    convention, out = Convention.of(dna), []
    column = {name.removeprefix(PREFIX): i for i, name in enumerate(dna.raw_control_names)}
    for joint, turn in enumerate(turns, len(dna.joint_names) - len(turns)):
        values = np.zeros((6, len(turn.motions)))
        for at, (rotation, shift) in enumerate(turn.motions.values()):
            values[:3, at] = shift
            values[3:, at] = sk.euler_angles(convention, rotation[None])[0]
        inputs = [column[name] for name in turn.motions]
        order, rows = np.argsort(inputs), np.flatnonzero(values.any(axis=1))
        out.append(
            JointGroup(
                lods=[len(rows)],
                input_indices=np.array(inputs)[order],
                output_indices=9 * joint + rows,
                values=values[rows][:, order].astype(np.float32),
                joint_indices=[joint],
            )
        )
    return out


def _add_meshes(
    dna: Dna,
    shapes: ShapeSet,
    parts: Sequence[FacePart],
    deltas: Sequence[_Delta],
    go_on: Callable[[], object],
) -> None:
    """Add a mesh with blend shape targets for each entry of `parts`."""
    size = float(np.ptp(shapes.mesh.positions[: parts[0].stop], axis=0).max())
    joints, meshes = list(dna.joint_names), []
    targets: list[list[BlendShapeTarget]] = [[] for _ in parts]
    for channel, (_, expression, share) in enumerate(deltas):
        go_on()
        delta = shapes.expressions[expression] * share
        for part, own_targets in zip(parts, targets, strict=True):
            own = delta[part.start : part.stop]
            moved = np.flatnonzero(np.linalg.norm(own, axis=1) > _LEAST * size)
            if len(moved):
                own_targets.append(
                    BlendShapeTarget(
                        deltas=own[moved], vertex_indices=moved, blend_shape_channel_index=channel
                    )
                )
    for part, own_targets in zip(parts, targets, strict=True):
        mesh = _mesh(_part_mesh(shapes.mesh, part), joints.index(part.joint))
        mesh.blend_shape_targets = own_targets
        meshes.append(mesh)
    mapping = [
        (number, int(target.blend_shape_channel_index))
        for number, own_targets in enumerate(targets)
        for target in own_targets
    ]
    dna.meshes = meshes
    dna.mesh_names = [f"{part.name or shapes.name}_lod0_mesh" for part in parts]
    dna.mesh_blend_shape_channel_mapping = np.array(mapping).reshape(-1, 2)
    dna.lod_mesh_mapping = [list(range(len(parts)))]


def _part_mesh(mesh: ObjMesh, part: FacePart) -> ObjMesh:
    if part.start == 0 and part.stop == len(mesh.positions):
        return mesh
    first, last = part.faces
    uv_faces = mesh.uv_faces[first:last]
    used, place = np.unique(np.concatenate(uv_faces), return_inverse=True)
    ends = np.cumsum([len(face) for face in uv_faces])[:-1]
    return ObjMesh(
        mesh.positions[part.start : part.stop],
        mesh.uvs[used],
        [[v - part.start for v in face] for face in mesh.faces[first:last]],
        [row.tolist() for row in np.split(place.ravel(), ends)],
    )


def _by_control(shapes: ShapeSet, controls: Mapping[str, Sequence[str]]) -> list[_Delta]:
    """For each control: its name, its expression, and its share of the expression's displacements.

    If several expressions have the same control, the last one counts.
    """
    out: dict[str, _Delta] = {}
    for expression in shapes.expressions:
        named = controls.get(expression, [expression])
        for name, part in zip(named, _shares(shapes, expression, named), strict=True):
            out[name] = name, expression, part
    return list(out.values())


def _shares(shapes: ShapeSet, expression: str, named: Sequence[str]) -> list[Doubles | float]:
    """float64[V, 1] for each control: its fraction of an expression. The fractions sum to 1.

    Controls that end in L and R get the left and right half. Controls of lips such as ...UL and
    ...DL get the upper and lower part, divided at the mean height of the vertices, weighted by
    their motion. The edges are soft.
    """
    if len(named) < 2:
        return [1.0] * len(named)
    delta = shapes.expressions[expression]
    x, y = shapes.mesh.positions[:, 0] * shapes.left, shapes.mesh.positions[:, 1]
    width = 0.06 * np.ptp(x)
    left = smooth_step(x / width + 0.5)
    moved = (delta**2).sum(axis=1)
    middle = (moved * y).sum() / max(float(moved.sum()), 1e-300)
    upper = smooth_step((y - middle) / (width / 3) + 0.5)
    half = {"L": left, "R": 1 - left, "U": upper, "D": 1 - upper}
    marks = [(_LIP.findall(name), name[-1:]) for name in named]
    lips, sides = {lip[0] for lip, _ in marks if lip}, {side for _, side in marks} & {"L", "R"}
    parts = []
    for lip, side in marks:
        part = half[side] if len(sides) == 2 and side in sides else np.ones(len(x))
        parts.append(part * half[lip[0]] if len(lips) == 2 and lip else part)
    whole = np.maximum(sum(parts), 1e-12)
    return [(part / whole)[:, None] for part in parts]


def _mesh(source: ObjMesh, joint: int) -> Mesh:
    positions, count = source.positions, len(source.positions)
    uvs, uv_faces = source.uvs, source.uv_faces
    if not len(uvs) or not all(uv_faces):
        uvs, uv_faces = np.zeros((count, 2)), source.faces
    mesh = polygon_mesh(
        positions, vertex_normals(positions, source.faces), source.faces, uvs, uv_faces
    )
    mesh.skin_offsets = np.arange(count + 1)
    mesh.skin_weights, mesh.skin_joint_indices = np.ones(count), np.full(count, joint, np.int64)
    mesh.maximum_influence_per_vertex = 1
    return mesh
