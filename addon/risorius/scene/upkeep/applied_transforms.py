# SPDX-License-Identifier: GPL-3.0-or-later
"""Undoes Apply Transform, Set Origin and similar steps on parts of a face.

The parts of a face are its deforming armature (rig), its control armature and its meshes. They must
fit each other. These steps of Blender move an object's transform into its data: the rig, which
follows the controls, would be transformed twice, and a mesh would leave its joints. Blender does
not report these steps, so the state of each part is stored and compared.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import cast

import bpy
import numpy as np
from mathutils import Euler, Matrix, Quaternion, Vector
from numpy.typing import NDArray

from ...logic.base.sentences import Sentence, told
from ..base import last_written, parts, session
from ..base.blender_types import ArmatureObject, MeshObject

_NEAR = 1e-5  # relative rounding error of products in float32
_FLAT = 1e-12  # smallest determinant of a matrix that can be inverted
_SAMPLES = 4  # approximate number of vertices compared to see whether a mesh changed
_BY_HAND = ("EDIT", "SCULPT")  # modes in which the user moves points


@dataclass(frozen=True)
class _Seen:
    """The state of a part at the last check.

    Attributes:
        own: its matrix, without parent and constraints.
        hung: its parent inverse matrix.
        parent: session uid of its parent, 0 for none.
        points: bytes of a float32[N, 3] array, ends of its bones or some of its vertices; empty
            while the user edits them.
    """

    own: Matrix
    hung: Matrix
    parent: int
    points: bytes


@dataclass(frozen=True)
class _Moved:
    """A part of a face with its positions before and after a step of Blender.

    Attributes:
        item: the part.
        before: state of the part before the step.
        stood, stands: matrix of the part before and after the step, in world space, or relative to
            a parent that does not belong to the face.
    """

    item: bpy.types.Object
    before: _Seen
    stood: Matrix
    stands: Matrix


# Session uid of an object (part of a face, or child of a part) -> stored state of this object.
_noted: dict[int, _Seen] = session.table("applied_transforms.noted", ("undo", "load"))
# Session uid of a deforming armature -> sentence about the last undone step.
_said: dict[int, Sentence] = session.table("applied_transforms.said", ("undo", "load"))


def last_said(rig: ArmatureObject) -> Sentence | None:
    """The sentence about the last undone step, or None.

    Args:
        rig: the deforming armature of the face.
    """
    return _said.get(rig.session_uid)


def take_back(
    rigs: Iterable[ArmatureObject], touched: AbstractSet[bpy.types.ID]
) -> list[ArmatureObject]:
    """Restore the parts of faces after a step of Blender that moved transforms into data.

    Args:
        rigs: deforming armatures of this file.
        touched: the datablocks of the update.

    Returns:
        Armatures with restored parts; `last_said` has the sentence.
    """
    known = bool(_noted)
    done = [rig for rig in rigs if _take_back(rig, touched)]
    for item in touched if known else bpy.data.objects:
        if isinstance(item, bpy.types.Object) and item.parent and parts.RIG not in item:
            _noted[item.session_uid] = _see(item, None, touched)
    return done


def _take_back(rig: ArmatureObject, touched: AbstractSet[bpy.types.ID]) -> bool:
    members = [item for item in parts.members_of(rig) if item.library is None]
    if rig.session_uid in _noted and touched.isdisjoint(members):
        return False
    before = {i: _noted[i.session_uid] for i in members if i.session_uid in _noted}
    now = {item: _see(item, before.get(item), touched) for item in members}
    _noted.update({item.session_uid: seen for item, seen in now.items()})
    _said.pop(rig.session_uid, None)
    stood = _places(rig, before, _followed(rig))
    stands = _places(rig, now, {})
    done = []
    for item, seen in before.items():
        moved = _Moved(item, seen, stood[item], stands[item])
        if seen != now[item] and _give_back(moved, now[item], members):
            _noted[item.session_uid] = _see(item, None, touched)
            done.append(item.name)
    if _clear_deltas(rig):
        done.append(rig.name)
    if done:
        _said[rig.session_uid] = told(
            "{names}: Blender's step was taken back, because joints, meshes and "
            "controls must stay aligned. To place the face, move {controls}.",
            names=done[0] if len(done) == 1 else f"{done[0]} (+{len(done) - 1})",
            controls=cast("bpy.types.Object", rig[parts.CONTROLS]).name,
        )
    return bool(done)


def _see(item: bpy.types.Object, before: _Seen | None, touched: AbstractSet[bpy.types.ID]) -> _Seen:
    """The current state of a part; points are read only if the update reports a change.

    Args:
        item: the part, or a child of a part.
        before: the state at the last check; None: read all.
        touched: the datablocks of the update.
    """
    if before is not None and item not in touched:
        return before
    parent, data = item.parent.session_uid if item.parent is not None else 0, item.data
    seen = _Seen(item.matrix_basis.copy(), item.matrix_parent_inverse.copy(), parent, b"")
    if item.mode in _BY_HAND or data is None or data.library is not None:
        return seen
    if before is not None and seen.own == before.own and data not in touched:
        return replace(seen, points=before.points)
    if isinstance(data, bpy.types.Mesh):
        return replace(seen, points=_samples(data))
    if isinstance(data, bpy.types.Armature):
        return replace(seen, points=_ends(data))
    return seen


def _samples(mesh: bpy.types.Mesh) -> bytes:
    points, count = mesh.vertices, len(mesh.vertices)
    chosen = range(0, count, max(1, count // _SAMPLES))
    return np.array([points[i].co for i in chosen], np.float32).tobytes()


def _ends(armature: bpy.types.Armature) -> bytes:
    return b"".join(_read(armature.bones, name).tobytes() for name in ("head_local", "tail_local"))


def _read(items: bpy.types.bpy_prop_collection, name: str) -> NDArray[np.float32]:
    """float32[N, 3]: the vector property `name` of each item."""
    found = np.empty(3 * len(items), np.float32)
    items.foreach_get(name, found)
    return found.reshape(-1, 3)


def _followed(rig: ArmatureObject) -> dict[bpy.types.Object, Matrix]:
    """World matrices of rig and controls when the rig last followed the controls.

    Other stored states can be older, because frame changes cause no update.

    Objects with a parent or a constraint are left out. Empty for a baked character, or if the rig
    has not followed yet.
    """
    controls, kept = parts.controls_of(rig), last_written.places.get(rig.session_uid)
    if not isinstance(kept, bytes) or parts.BAKED in rig:
        return {}
    place = Matrix(np.frombuffer(kept).reshape(4, 4).tolist())
    return {
        item: place
        for item in (rig, controls)
        if item is not None and item.parent is None and not item.constraints
    }


def _places(
    rig: ArmatureObject,
    seen: Mapping[bpy.types.Object, _Seen],
    known: Mapping[bpy.types.Object, Matrix],
) -> dict[bpy.types.Object, Matrix]:
    """The matrix of each part of a face: world matrix, or matrix relative to a parent object that
    does not belong to the face.

    Args:
        rig: deforming armature of the face.
        seen: part -> its state.
        known: part -> its matrix, which replaces the matrix of the state.
    """
    found = {item: known.get(item, _local(one)) for item, one in seen.items()}
    carried = [i for i in seen if i.parent == rig and i.parent_type == "OBJECT" and rig in found]
    found.update({item: found[rig] @ found[item] for item in carried})
    return found


def _local(seen: _Seen) -> Matrix:
    return seen.hung @ seen.own if seen.parent else seen.own


def _give_back(moved: _Moved, now: _Seen, members: Collection[bpy.types.Object]) -> bool:
    """Undo the changes that a step of Blender, such as Apply Transform, made to one part.

    Args:
        moved: the part with its state before the step.
        now: the state after the step.
        members: the parts of the face.

    Returns:
        Whether a change was undone.
    """
    item, before = moved.item, moved.before
    if before.parent != now.parent:
        return False
    back = _way_back(moved, now)
    if back is None:
        shifted = _differ(before.own, now.own) or _differ(before.hung, now.hung)
        if item.type != "MESH" or not shifted or not _is_held(item):
            return False
    else:
        data = cast("bpy.types.Mesh | bpy.types.Armature", item.data)
        if isinstance(data, bpy.types.Mesh):
            data.transform(back, shape_keys=True)
        else:
            data.transform(back)
        data.update_tag()
    item.matrix_parent_inverse = before.hung
    # A frame change moves an armature without an update, so its stored matrix may come from another
    # frame.
    same = item.parent is not None or now.own == before.own
    item.matrix_basis = before.own if same else moved.stood
    for child in item.children:
        if child not in members and child.library is None:
            _keep_in_place(child, moved)
    return True


def _clear_deltas(rig: ArmatureObject) -> bool:
    """Move the delta transforms of a rig into its transform, because Apply Transform gives wrong
    results for an object with delta transforms.

    Returns:
        Whether the rig had a delta transform.
    """
    neutral = Vector(), Euler(), Quaternion(), Vector((1.0, 1.0, 1.0))
    names = ("location", "rotation_euler", "rotation_quaternion", "scale")
    if all(getattr(rig, f"delta_{n}") == v for n, v in zip(names, neutral, strict=True)):
        return False
    place = rig.matrix_basis.copy()
    for name, value in zip(names, neutral, strict=True):
        setattr(rig, f"delta_{name}", value)
    rig.matrix_basis = place
    return True


def _differ(one: Matrix, other: Matrix) -> bool:
    """Whether two matrices differ by more than rounding."""
    first, second = np.array(one), np.array(other)
    return bool(np.abs(first - second).max() > _NEAR * np.abs(first).max())


def _keep_in_place(child: bpy.types.Object, moved: _Moved) -> None:
    """Restore the world transform of a child of a part.

    Blender itself does not restore the transforms of some children of bones.
    """
    before = _noted.get(child.session_uid)
    if before is not None and before.parent == moved.item.session_uid:
        child.matrix_parent_inverse, child.matrix_basis = before.hung, before.own


def _is_held(item: bpy.types.Object) -> bool:
    """Whether the transform of a part is locked, not animated and without constraints."""
    locked = all((*item.lock_location, *item.lock_rotation, *item.lock_scale))
    return locked and item.animation_data is None and not item.constraints


def _way_back(moved: _Moved, now: _Seen) -> Matrix | None:
    """The matrix that moves the data of a part (vertices or bones) back to their earlier places.

    None if no step of Blender has moved the transform of the part into its data.
    """
    old, new = (
        np.frombuffer(seen.points, np.float32).reshape(-1, 3).astype(np.float64)
        for seen in (moved.before, now)
    )
    if old.shape != new.shape or not old.size or np.array_equal(old, new):
        return None
    if abs(moved.stood.determinant()) < _FLAT:
        return None
    stood, stands = _at(moved.stood, old), _at(moved.stands, new)
    limit = _NEAR * np.abs(stood).max()
    if np.abs(stood - stands).max() <= limit < np.abs(old - new).max():
        return moved.stood.inverted() @ moved.stands
    shift = (old - new).mean(axis=0)
    near = _NEAR * max(np.abs(old).max(), np.abs(new).max())
    if np.abs(old - new - shift).max() > near or np.abs(shift).max() <= near:
        return None
    # Set Origin moves an object with a constraint by a wrong distance, so world positions do not
    # show whether Set Origin was used. A changed location or centred data show its use.
    told = moved.before.own.translation != now.own.translation or _is_centred(moved.item)
    return Matrix.Translation(Vector(shift.tolist())) if told else None


def _at(place: Matrix, points: NDArray[np.float64]) -> NDArray[np.float64]:
    matrix = np.array(place)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _is_centred(item: bpy.types.Object) -> bool:
    """Whether an object's data are centred on its origin, as after Geometry to Origin."""
    if item.type == "MESH":
        points = _read(cast("MeshObject", item).data.vertices, "co")
    else:
        points = np.frombuffer(_ends(cast("ArmatureObject", item).data), np.float32).reshape(-1, 3)
    low, high, middle = points.min(axis=0), points.max(axis=0), points.mean(axis=0)
    near = 10 * _NEAR * np.abs(high - low).max()
    return bool(min(np.abs(low + high).max() / 2, np.abs(middle).max()) <= near)
