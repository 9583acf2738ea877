# SPDX-License-Identifier: GPL-3.0-or-later
"""Places faces: the deforming armature follows the control armature, which may follow a body.

The armatures are not parented, because an edit of a parent makes Blender deform the meshes twice.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import cast

import bpy
import numpy as np
from mathutils import Quaternion, Vector
from numpy.typing import NDArray

from ..base import last_written, parts, saved
from ..base.blender_types import ArmatureObject, Depsgraph

CONSTRAINT = "Risorius Body"
_GAP = 1.25  # distance between neighbouring faces, in widths of a face
_NEAR = 1e-6  # tolerance relative to the largest number of the matrix: float32 rounding


def follow(rig: ArmatureObject, seen: ArmatureObject) -> None:
    """Copy the world matrix of the control armature to the rig, if the rig follows it.

    Args:
        rig: the original (not evaluated) deforming armature.
        seen: the evaluated control armature.
    """
    if not _follows(rig):
        return
    wanted = np.array(seen.matrix_world, np.float64)  # Blender 5 would give float32
    # Also write rounding differences, so that a frame does not depend on the frame before it.
    if last_written.is_new(last_written.places, rig, wanted.tobytes()) or not _is_at(rig, wanted):
        rig.matrix_basis = seen.matrix_world


def has_strayed(rig: ArmatureObject) -> bool:
    """Whether the user or a script moved a rig that follows its controls.

    Args:
        rig: the original (not evaluated) deforming armature.
    """
    last = last_written.places.get(rig.session_uid)
    return isinstance(last, bytes) and _follows(rig) and not _is_at(rig, np.frombuffer(last))


def _follows(rig: ArmatureObject) -> bool:
    return bool(rig.get(parts.FOLLOW)) and not rig.parent and not rig.constraints


def _is_at(rig: ArmatureObject, wanted: NDArray[np.float64]) -> bool:
    """Whether a rig's object matrix equals a matrix up to rounding.

    Args:
        wanted: the matrix.
    """
    there = np.array(rig.matrix_basis).ravel()
    return bool(np.abs(there - wanted.ravel()).max() <= _NEAR * np.abs(wanted).max())


def put_beside(scene: bpy.types.Scene, rig: ArmatureObject) -> bool:
    """Move a new face along +x until no other face is near.

    Args:
        scene: the scene with the other faces, including linked ones.
        rig: deforming armature of the new face.

    Returns:
        Whether the face was moved.
    """
    others = [r for r in parts.rigs(linked=True) if r != rig and scene in r.users_scene]
    there = [c.matrix_world.translation for c in map(parts.controls_of, others) if c is not None]
    step = _GAP * _width(rig)
    spot = parts.controls_there(rig).location
    free = next(n for n in range(len(there) + 1) if not _taken(there, spot, n * step, step / 2))
    spot.x += free * step
    return free > 0


def put_beside_mesh(rig: ArmatureObject, item: bpy.types.Object) -> None:
    """Move a new face beside its source mesh, along +x.

    Args:
        rig: deforming armature of the face, which has the same origin as the mesh object.
        item: the mesh object.
    """
    place = item.matrix_world.translation
    parts.controls_there(rig).location = place + Vector((_GAP * _width(rig), 0.0, 0.0))


def put_clear_of(rig: ArmatureObject, item: bpy.types.Object) -> None:
    """Move a new face along +x past an object if their ranges of x overlap.

    Args:
        rig: deforming armature of the face.
        item: an object that is no face.
    """
    spot, width = parts.controls_there(rig).location, _width(rig)
    left = spot.x + min((c[0] for m in parts.meshes_of(rig) for c in m.bound_box), default=0.0)
    across = [(item.matrix_world @ Vector(corner)).x for corner in item.bound_box]
    if left < max(across) and left + width > min(across):
        spot.x += max(across) - left + (_GAP - 1.0) * width


def _taken(there: Iterable[Vector], spot: Vector, shift: float, reach: float) -> bool:
    return any((at - spot - Vector((shift, 0.0, 0.0))).length < reach for at in there)


def _width(rig: ArmatureObject) -> float:
    """The extent of a face's meshes in x, in Blender units without object scale."""
    ends = [corner[0] for item in parts.meshes_of(rig) for corner in item.bound_box]
    return max(ends, default=0.0) - min(ends, default=0.0)


def find_bones(body: ArmatureObject) -> tuple[str, str, str]:
    """The neck, head and base bones of a body by their names, in any naming scheme.

    Args:
        body: an armature object.

    Returns:
        (base, neck, head): bone names, "" if missing. The base is the parent of the neck, so that
        the seam at the neck stays closed when the neck bends. Without such a parent it is the neck
        itself, or the head if there is no neck.
    """
    bones = list(body.data.bones)
    head = _named(bones, "head")
    neck = _named(bones, "neck")
    first = body.data.bones.get(neck or head)
    base = first.parent.name if neck and first is not None and first.parent else (neck or head)
    return base, neck, head


def _named(bones: Iterable[bpy.types.Bone], word: str) -> str:
    """Of the bones whose names contain a whole word, the bone nearest to the root; "" if none."""
    pattern = re.compile(rf"(?:^|[^a-z]){word}(?![a-z])", re.IGNORECASE)
    found = [b for b in bones if pattern.search(_split(b.name))]
    found.sort(key=lambda b: (len(b.parent_recursive), b.name))
    return found[0].name if found else ""


def _split(name: str) -> str:
    """Split camel case: `mixamorigHead` becomes `mixamorig Head`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)


def attach(
    controls: ArmatureObject,
    body: ArmatureObject,
    base: str,
    neck: str = "",
    head: str = "",
    fit: str = "MOVE",
) -> None:
    """Attach a face to a body with a Child Of constraint.

    Args:
        controls: the control armature of the face.
        body: an armature object, at any scale.
        base: the body's bone that carries the whole face.
        neck, head: the body's bones that rotate the face's own neck and head; "": none.
        fit: "NONE": do not move the face; "MOVE": move the face so that its head bone is at
            the rest position of the body's head bone (without head bones: neck bones); "SCALE":
            also scale the face so that the neck lengths are equal.
    """
    detach(controls)
    if fit != "NONE":
        _fit(controls, body, neck, head, fit == "SCALE")
    hold = cast("bpy.types.ChildOfConstraint", controls.constraints.new("CHILD_OF"))
    hold.name = CONSTRAINT
    hold.target, hold.subtarget = body, base
    # The face is attached relative to the body's rest pose, so that it follows the body's current
    # pose at once.
    rest = body.matrix_world @ body.data.bones[base].matrix_local
    hold.inverse_matrix = rest.inverted_safe()
    hold.set_inverse_pending = False
    controls[parts.BODY_NECK] = "\n".join(_neck_chain(body, base, neck, head))
    controls[parts.BODY_HEAD] = head if head != base else ""
    controls.update_tag()


def _neck_chain(body: ArmatureObject, base: str, neck: str, head: str) -> list[str]:
    """The neck bones of a body, from `neck` to the parent of `head`, without `base`.

    A body may have more than one neck bone.
    """
    if not neck:
        return []
    bone = body.data.bones.get(head)
    parents: list[bpy.types.Bone] = bone.parent_recursive if bone is not None else []
    above = [parent.name for parent in parents]
    chain = above[: above.index(neck) + 1][::-1] if neck in above else [neck]
    return [name for name in chain if name != base]


def body_of(controls: ArmatureObject) -> bpy.types.ChildOfConstraint | None:
    """The constraint that attaches a face to a body; None if there is none or it has no target."""
    hold = controls.constraints.get(CONSTRAINT)
    if hold is None or hold.type != "CHILD_OF":
        return None
    found = cast("bpy.types.ChildOfConstraint", hold)
    return found if found.target else None


def body_turns(controls: ArmatureObject, depsgraph: Depsgraph) -> dict[str, Quaternion]:
    """Rotations of a body's neck and head bones, which the face adds to its own.

    Copy Rotation constraints are no alternative, because they assume equal object rotations, and
    bodies from other programs are rotated and scaled objects.

    Args:
        controls: the original (not evaluated) control armature.
        depsgraph: the evaluated dependency graph.

    Returns:
        "neck" and "head" -> Quaternion in the control armature's axes; unrotated bones are absent.
    """
    hold = body_of(controls)
    if hold is None:
        return {}
    body = cast("ArmatureObject", hold.target)
    rest = body.data.bones.get(hold.subtarget)
    if rest is None or hold.mute:
        return {}
    seen = body.evaluated_get(depsgraph)
    # `axes` rotates from the control armature's space to the body's space in the body's rest pose.
    axes = (rest.matrix_local @ hold.inverse_matrix @ controls.matrix_basis).to_quaternion()
    turns = {}
    for own, key in (("neck", parts.BODY_NECK), ("head", parts.BODY_HEAD)):
        total = Quaternion()
        for name in saved.text(controls, key).split("\n"):
            bone = seen.pose.bones.get(name)
            if bone is not None:
                total = total @ own_turn(seen, bone)
        if total.angle:
            turns[own] = axes.inverted() @ total @ axes
    return turns


def own_turn(seen: ArmatureObject, bone: bpy.types.PoseBone) -> Quaternion:
    """The rotation of a bone relative to rest and parent, with constraints, in the armature's axes.

    Args:
        seen: the evaluated armature.
        bone: a pose bone of this armature.
    """
    local = seen.convert_space(
        pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
    )
    rest = bone.bone.matrix_local.to_quaternion()
    return rest @ local.to_quaternion() @ rest.inverted()


def _fit(controls: ArmatureObject, body: ArmatureObject, neck: str, head: str, scale: bool) -> None:
    """Move the face so that its head bone at rest meets the body's head bone at rest.

    If a head bone is missing, the neck bones are used instead.

    Args:
        controls: the control armature of the face.
        body: the armature object of the body.
        neck, head: names of the body's bones; "": none.
        scale: True: also scale the face, so that its neck is as long as the neck of the body.
    """
    own = controls.data.bones
    pairs = [
        (
            controls.matrix_world @ own[name].head_local,
            body.matrix_world @ body.data.bones[b].head_local,
        )
        for name, b in (("head", head), ("neck", neck))
        if b and name in own
    ]
    if not pairs:
        return
    matrix = controls.matrix_world.copy()
    if scale and len(pairs) == 2:
        length = (pairs[0][0] - pairs[1][0]).length
        factor = (pairs[0][1] - pairs[1][1]).length / length if length else 1.0
        if factor:
            anchor = pairs[0][0]
            matrix.translation = anchor + (matrix.translation - anchor) * factor
            for axis in range(3):
                for row in range(3):
                    matrix[row][axis] *= factor
    matrix.translation += pairs[0][1] - pairs[0][0]
    controls.matrix_world = matrix


def detach(controls: ArmatureObject) -> None:
    """Detach a face from its body; the face stays at its current position."""
    holds = [c for c in controls.constraints if c.name == CONSTRAINT]
    if holds:
        where = controls.matrix_world.copy()
        for hold in holds:
            controls.constraints.remove(hold)
        controls.matrix_world = where
    for key in (parts.BODY_NECK, parts.BODY_HEAD):
        if key in controls:
            del controls[key]
    controls.update_tag()
