# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces the joints of an armature by the joints of another DNA file, and finds edited joints."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...logic.base import names
from ...logic.base.sentences import told
from ...logic.character import plans, user_edits
from ..base import parts, saved
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..character import armatures, bone_shapes
from .file_change import Change

_EPS = float(np.finfo(np.float32).eps)  # relative rounding of float32


@dataclass(frozen=True)
class JointEdit:
    """A user's edit of a joint's rest pose.

    Attributes:
        before, after: float64[4, 4], rest matrices relative to the parent, in Blender units.
        moved, turned: whether the position and the rotation changed.
    """

    before: NDArray[np.float64]
    after: NDArray[np.float64]
    moved: bool
    turned: bool

    @property
    def change(self) -> NDArray[np.float64]:
        """float64[4, 4]: factor by which the joint's local matrix in the file is multiplied from
        the right."""
        return np.linalg.inv(self.before) @ self.after

    @property
    def distance(self) -> float:
        """Distance of the move in Blender units."""
        return float(np.linalg.norm(self.after[:3, 3] - self.before[:3, 3]))

    @property
    def angle(self) -> float:
        """Angle of the rotation in radians."""
        return _angle(self.change)


def _angle(matrix: NDArray[np.float64]) -> float:
    turn = matrix[:3, :3]
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return float(np.arctan2(np.linalg.norm(twice), np.trace(turn) - 1.0))


def bones_by_joint(rig: ArmatureObject) -> dict[int, str]:
    """Joint index -> bone name; the first bone if several have the same joint index."""
    found = {}
    for bone in rig.data.bones:
        joint = saved.whole(bone, parts.JOINT, -1, 0)
        if joint >= 0:
            found.setdefault(joint, bone.name)
    return found


def joint_edits(
    context: Context, rig: ArmatureObject, plan: plans.CharacterPlan
) -> dict[int, JointEdit]:
    """The joints whose rest pose a user moved or rotated in edit mode.

    The rest pose is compared with a newly built armature. Differences that the rounding of a bone's
    direction to float32 can cause are ignored, because edit mode recomputes roll and tail.

    Args:
        context: a Blender context with a view layer.
        rig: deforming armature.
        plan: joints of the armature's DNA file.

    Returns:
        Joint index -> edit.
    """
    wanted = _fresh_rest(context, plan)
    names = bones_by_joint(rig)
    present = {
        j: np.array(rig.data.bones[n].matrix_local, np.float64)
        for j, n in names.items()
        if j < len(wanted)
    }
    reach = float(np.max(np.abs(wanted[:, :3, 3]), initial=0.0))
    found = {}
    for joint, now in present.items():
        parent = plan.armature.parents[joint]
        above = parent if parent in present else -1
        same = np.array_equal(now, wanted[joint])
        if same and (above < 0 or np.array_equal(present[above], wanted[above])):
            continue
        before = _relative(wanted, joint, above)
        after = _relative(present, joint, above)
        shortest = min(plan.armature.lengths[j] for j in (joint, above) if j >= 0)
        turn = 16 * _EPS * (reach + shortest) / shortest
        move = 8 * _EPS * reach
        if above >= 0:
            move += turn * float(np.linalg.norm(before[:3, 3]))
        edit = JointEdit(before, after, False, False)
        edit = replace(edit, moved=edit.distance > move, turned=edit.angle > turn)
        if edit.moved or edit.turned:
            found[joint] = edit
    return found


def _relative(
    world: NDArray[np.float64] | Mapping[int, NDArray[np.float64]], joint: int, parent: int
) -> NDArray[np.float64]:
    return world[joint] if parent < 0 else np.linalg.inv(world[parent]) @ world[joint]


def _fresh_rest(context: Context, plan: plans.CharacterPlan) -> NDArray[np.float64]:
    """float64[J, 4, 4]: rest matrices of all joints after an import, in the armature's space."""
    made = []
    workshop = bpy.data.collections.new("rest")
    context.scene.collection.children.link(workshop)
    try:
        rig = armatures.build_rig(context, plan, made, workshop)
        bones = rig.data.bones
        return np.array([bones[n].matrix_local for n in plan.armature.labels], np.float64)
    finally:
        bpy.data.batch_remove([*made, workshop])


def replace_joints(context: Context, change: Change) -> None:
    """Give the armature the joints of the new file; bones of joints with the same names are kept.

    Args:
        context: a Blender context with a view layer.
        change: the replacement; this function sets its old_bones and new_bones.
    """
    rig, old, new = change.rig, change.old.armature, change.new.armature
    if rig.data.users > 1:
        rig.data = rig.data.copy()
    moved = user_edits.index_map(old.labels, new.labels)
    there = bones_by_joint(rig)
    change.old_bones = [there.get(j, label) for j, label in enumerate(old.labels)]
    edited = joint_edits(context, rig, change.old)
    kept = {moved[j]: n for j, n in there.items() if j < len(moved) and moved[j] >= 0}
    gone = {n: j for j, n in there.items() if j >= len(moved) or moved[j] < 0}
    rest, changed = _new_rest(old, new, moved, edited)
    if changed or gone or len(kept) < len(new.labels):
        with armatures.edit_armature(context, rig.data) as edit_bones:
            change.new_bones = _edit(edit_bones, change, kept, gone, rest, changed)
    else:
        change.new_bones = [kept[k] for k in range(len(new.labels))]
    _number(rig, change.new_bones, moved)
    shelf = rig.data.collections.get(armatures.SHELF)
    for joint, name in enumerate(change.new_bones):
        if joint not in kept and shelf is not None:
            shelf.assign(rig.data.bones[name])
    _release(change, moved)
    lost = [old.labels[j] for j in gone.values() if j < len(old.labels)]
    if len(lost) > names.LISTED:
        change.report.append(
            told("{count} joints are gone: {lost}.", count=len(lost), lost=names.listed(lost))
        )
    else:
        change.report += [told("The joint {label} is gone.", label=label) for label in lost]
    added = [label for k, label in enumerate(new.labels) if k not in kept]
    if added:
        change.report.append(told("New joints: {added}.", added=names.listed(added)))
    for joint in edited:
        if moved[joint] >= 0:
            change.report.append(
                told("Your edit of the joint {joint} was carried over.", joint=old.labels[joint])
            )


def _new_rest(
    old: plans.ArmaturePlan,
    new: plans.ArmaturePlan,
    moved: Sequence[int],
    edited: Mapping[int, JointEdit],
) -> tuple[dict[int, NDArray[np.float64]], set[int]]:
    """The rest matrices of the new joints in the armature's space, with the user's edits; and the
    joints whose bones must be changed in edit mode.

    Args:
        old, new: joints of the old and of the new file.
        moved: new index of each old joint; -1 if the new file lacks it.
        edited: index of an old joint -> edit by the user.
    """
    back = {k: j for j, k in enumerate(moved) if k >= 0}
    rest, changed = {}, set()
    bent = set()  # edited joints and their descendants, whose rest differs from the file
    for joint in new.order:
        parent = new.parents[joint]
        former = back.get(joint)
        local = _relative(new.rest, joint, parent)
        if former is not None and former in edited:
            local = local @ edited[former].change
            bent.add(joint)
        if parent in bent:
            bent.add(joint)
        if joint not in bent:
            rest[joint] = new.rest[joint]
        else:
            rest[joint] = local if parent < 0 else rest[parent] @ local
        above = old.parents[former] if former is not None else -1
        same_parent = former is not None and (moved[above] if above >= 0 else -1) == parent
        if not (
            same_parent
            and parent not in changed
            and np.array_equal(old.rest[former], new.rest[joint])
            and old.lengths[former] == new.lengths[joint]
        ):
            changed.add(joint)
    return rest, changed


def _edit(
    edit_bones: bpy.types.ArmatureEditBones,
    change: Change,
    kept: Mapping[int, str],
    gone: Collection[str],
    rest: Mapping[int, NDArray[np.float64]],
    changed: Collection[int],
) -> list[str]:
    """Remove, add and move bones in edit mode.

    Args:
        edit_bones: edit bones of the deforming armature.
        change: the replacement.
        kept: index of a joint of the new file -> name of its existing bone.
        gone: names of bones whose joints the new file lacks.
        rest: index of a joint of the new file -> float64[4, 4], rest matrix in the armature's
            space.
        changed: indices of joints of the new file whose bones must be changed.

    Returns:
        The bone name of each joint of the new file.
    """
    old, new = change.old.armature, change.new.armature
    follow = _followers(edit_bones, kept, gone)
    for name in gone:
        edit_bones.remove(edit_bones[name])
    bones = {joint: edit_bones[name] for joint, name in kept.items()}
    back = {k: j for j, k in enumerate(user_edits.index_map(old.labels, new.labels)) if k >= 0}
    for joint in new.order:
        fresh = joint not in bones
        if fresh:
            bones[joint] = edit_bones.new(new.labels[joint])
        elif joint not in changed:
            continue
        bone = bones[joint]
        bone.use_connect = False
        length = new.lengths[joint]
        if not fresh and abs(bone.length - old.lengths[back[joint]]) > 1e-4 * bone.length:
            length = bone.length  # keep a length that the user edited
        bone.head, bone.tail, bone.roll = (0, 0, 0), (0, length, 0), 0.0
        bone.matrix = Matrix(rest[joint].tolist())
        parent = new.parents[joint]
        bone.parent = bones[parent] if parent >= 0 else None
    for name, above, offset in follow:
        bone = edit_bones[name]
        if above is not None:
            bone.parent = edit_bones[above]
        if bone.parent is not None and offset is not None:
            bone.matrix = bone.parent.matrix @ offset
    return [bones[k].name for k in range(len(new.labels))]


def _followers(
    edit_bones: bpy.types.ArmatureEditBones, kept: Mapping[int, str], gone: Collection[str]
) -> list[tuple[str, str | None, Matrix | None]]:
    """The user's own bones, parents first: (name, new parent, matrix relative to the parent).

    With these values the bones follow their joints. New parent None: the bone keeps its parent.

    Args:
        edit_bones: edit bones of the deforming armature.
        kept: index of a new joint -> name of its existing bone.
        gone: names of bones whose joints the new file lacks.
    """
    ours = set(kept.values()) | set(gone)
    found = []
    for bone in edit_bones:
        if bone.name in ours or bone.parent is None:
            continue
        above = bone.parent
        while above is not None and above.name in gone:
            above = above.parent
        offset = above.matrix.inverted() @ bone.matrix if above is not None else None
        lost = above.name if above is not None and above is not bone.parent else None
        found.append((bone.name, lost, offset, _depth(bone)))
    return [f[:3] for f in sorted(found, key=lambda f: f[3])]


def _depth(bone: bpy.types.EditBone) -> int:
    return len(bone.parent_recursive)


def _number(rig: ArmatureObject, names: Sequence[str], moved: Sequence[int]) -> None:
    """Store the new joint indices on the bones and on the user's copies of these bones.

    Args:
        rig: deforming armature.
        names: bone name of each new joint.
        moved: new index of each old joint; -1 if the new file lacks it.
    """
    by_name = {name: joint for joint, name in enumerate(names)}
    for bone in rig.data.bones:
        former = saved.whole(bone, parts.JOINT, -1, 0)
        if bone.name in by_name:
            bone[parts.JOINT] = by_name[bone.name]
        elif parts.JOINT in bone:
            there = moved[former] if 0 <= former < len(moved) else -1
            if there >= 0:
                bone[parts.JOINT] = there
            else:
                del bone[parts.JOINT]


def _release(change: Change, moved: Sequence[int]) -> None:
    """Reset the pose of joints that the evaluator moves with the old file but not with the new one.

    Args:
        change: the replacement.
        moved: new index of each old joint; -1 if the new file lacks it.
    """
    owned = change.after.owned
    for joint in change.before.owned:
        there = moved[joint]
        if there >= 0 and there not in owned:
            change.rig.pose.bones[change.new_bones[there]].matrix_basis.identity()


def rename_groups(change: Change, item: MeshObject) -> None:
    """Name the vertex groups of a newly built mesh after the bones of the existing rig.

    Args:
        change: the replacement, with the bone names of the new joints.
        item: the mesh object.
    """
    labels = change.new.armature.labels
    real = {label: change.new_bones[k] for k, label in enumerate(labels)}
    for group in item.vertex_groups:
        wanted = real.get(group.name, group.name)
        if wanted != group.name:
            group.name = wanted


def replace_control_places(context: Context, change: Change) -> None:
    """Move the control bones to the positions for the new face, except bones that the user moved.

    Args:
        context: its scene is used to edit bones.
        change: the replacement.
    """
    old = armatures.control_places(change.old)
    new = armatures.control_places(change.new)
    controls = parts.controls_there(change.rig)
    near = change.old.size * 1e-5
    movable = [
        name
        for name, (position, *_rest) in old.items()
        if name in controls.data.bones
        and not np.allclose(old[name][0], new[name][0], atol=1e-9)
        and np.allclose(controls.data.bones[name].head_local[:], position, atol=near)
    ]
    if not movable:
        return
    if controls.data.users > 1:
        controls.data = controls.data.copy()
    room, bones = armatures.outline_room(change.old), controls.pose.bones
    placed = [name for name in movable if bone_shapes.is_placed(bones[name], name, room)]
    with armatures.edit_armature(context, controls.data) as edit_bones:
        for name in movable:
            position, axis, length, _parent = new[name]
            bone = edit_bones[name]
            bone.head = position
            bone.tail = Vector(position) + Vector(axis) * length
    room = armatures.outline_room(change.new)
    for name in placed:
        bone_shapes.place(controls.pose.bones[name], name, room)
