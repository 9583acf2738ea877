# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds, repairs and removes the bones of a face board.

A constraint scales the bone `board` and its children, the handles. So the location of a handle
gives the value of its GUI control, and actions fit faces of every size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ... import native
from ...logic.base.space import world_matrices
from ...logic.character import board_layout, primary_layout, primary_table
from ...logic.character.board_layout import Board, Handle
from ..base import parts
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..lod import lods
from . import armatures, board, bone_shapes, runtime

COLLECTION = "Face Board"
BORDER, FRAMES = runtime.BOARD_BONES
_SHARE = 1.3  # height of a complete board / largest extent of the meshes and joints of the face
_AWAY = 0.42  # distance from the face to a complete board / the same extent
_SIDE_COLOURS = {"L": (0.25, 0.6, 1.0), "R": (1.0, 0.35, 0.3), "": (1.0, 0.8, 0.2)}
_LINE_COLOUR = (0.8, 0.8, 0.82)
_BORDER_COLOUR = (0.25, 0.75, 0.45)


@dataclass(frozen=True)
class _Place:
    """Centre of a board in Blender units, and the length of a board unit in Blender units."""

    middle: Vector
    unit: float


def add(context: Context, rig: ArmatureObject) -> int:
    """Build the face board of a character, or its missing bones.

    Args:
        context: with a view layer.
        rig: the character; its control armature must not be linked.

    Returns:
        The number of new handles.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    layout = _layout(live)
    new = [handle for handle in layout.handles if handle.bone not in controls.data.bones]
    bars = [name for name in runtime.BOARD_BONES if name not in controls.data.bones]
    if not new and not bars:
        return 0
    if controls.data.users > 1:
        controls.data = controls.data.copy()
    primary = live.board == runtime.PRIMARY
    place = _near(rig, live, layout) if primary else _beside(rig, live, layout)
    with (
        armatures.kept_selection(context),
        armatures.edit_armature(context, controls.data) as edit_bones,
    ):
        _build(edit_bones, [*bars], new, layout, place.middle)
    context.view_layer.update()
    _dress(controls, layout, [*bars, *(handle.bone for handle in new)], place.unit)
    _show_bones(controls, [*bars, *(handle.bone for handle in new)])
    if primary:
        bone_shapes.step_aside(controls, aside=True)
    armatures.pull_more(rig, controls)
    context.view_layer.update()
    return len(new)


def _layout(live: runtime.Runtime) -> Board:
    taken = (*runtime.CONTROL_BONES, *runtime.BOARD_BONES)
    table, sideways = live.table, _sideways(live)
    if live.board == runtime.PRIMARY:
        return primary_layout.lay_out(table, primary_table.handles_of(table, sideways, taken))
    regions = native.regions()
    ways = board_layout.ways_of(table, live.labels, sideways)
    planned = board_layout.handles_of(table, ways, regions.of_slider, taken)
    return board_layout.lay_out(planned, regions.titles, table.is_own)


def remove(context: Context, rig: ArmatureObject) -> int:
    """Remove the face board of a character; keys of its handles stay in the actions.

    Args:
        context: with a view layer.
        rig: the character; its control armature must not be linked.

    Returns:
        The number of removed bones.
    """
    controls = parts.controls_there(rig)
    there = [bone.name for bone in controls.data.bones if parts.BOARD in bone]
    shapes = {controls.pose.bones[name].custom_shape for name in there} - {None}
    for name in there:
        controls.pose.bones[name].custom_shape = None
    armatures.pull_less(rig, there)
    with (
        armatures.kept_selection(context),
        armatures.edit_armature(context, controls.data) as edit_bones,
    ):
        for name in there:
            edit_bones.remove(edit_bones[name])
    shelf = controls.data.collections.get(COLLECTION)
    if shelf is not None and not len(shelf.bones):
        controls.data.collections.remove(shelf)
    unused = [shape for shape in shapes if shape is not None and not shape.users]
    meshes = [shape.data for shape in unused]
    bpy.data.batch_remove(unused)
    bpy.data.batch_remove([mesh for mesh in meshes if mesh is not None and not mesh.users])
    bone_shapes.step_aside(controls, aside=False)
    board.set_kind(controls, runtime.COMPLETE)
    context.view_layer.update()
    return len(there)


def corners(controls: ArmatureObject) -> NDArray[np.float64]:
    """float64[N, 3] in world space: the corners of a face board's border.

    If the border has no custom shape, its origin is the only point.

    Args:
        controls: control armature with the board.
    """
    bone = controls.pose.bones[BORDER]
    drawn = bone.custom_shape.data if bone.custom_shape is not None else None
    points = [v.co for v in drawn.vertices] if isinstance(drawn, bpy.types.Mesh) else [Vector()]
    matrix = controls.matrix_world @ bone.matrix
    return np.array([matrix @ point for point in points], np.float64)


def show(controls: ArmatureObject, visible: bool) -> None:
    """Show or hide the bones of the board.

    Args:
        controls: control armature of the character.
        visible: True: show; False: hide.
    """
    shelf = controls.data.collections.get(COLLECTION)
    if shelf is not None and controls.data.library is None:
        shelf.is_visible = visible


def _sideways(live: runtime.Runtime) -> dict[int, float]:
    """Index of a GUI control -> joint motion along +x, divided by the motion's length; -1 to 1.

    The motion from rest to the control's highest value is summed over all joints; +x is the left
    side of the face. Only controls that move the middle of the face sideways are included. The
    names of these controls do not define the direction, because "left" in jawLeft may mean the
    viewer's left.
    """
    table = live.table
    chosen = [
        gui
        for gui in range(len(table.names))
        if board_layout.is_middle(table, gui)
        and board_layout.is_beside(table, live.labels, gui)
        and table.highest[gui] > 0.0
    ]
    if not chosen:
        return {}
    gui = np.zeros((len(chosen), len(table.names)))
    gui[range(len(chosen)), chosen] = table.highest[chosen]
    rests = np.array(live.rests, np.float32)
    raw = np.where(table.reached, table.raw(gui), rests)
    poses = live.rig.evaluate_batch(np.ascontiguousarray(raw, np.float32)).joints
    still = _points(live, live.rig.evaluate(rests).joints)
    found = {}
    for index, joints in zip(chosen, poses, strict=True):
        moved = _points(live, joints) - still
        length = float(np.linalg.norm(moved, axis=1).sum())
        found[index] = float(moved[:, 0].sum()) / length if length else 0.0
    return found


def _points(live: runtime.Runtime, deltas: NDArray[np.float32]) -> NDArray[np.float64]:
    """float64[J, 3]: joint positions in Blender units.

    Args:
        deltas: float32[J, 9] of a Pose.
    """
    dna, space = live.dna, live.space
    angles = np.asarray(dna.neutral_joint_rotations, np.float64)
    if live.rig.rotation == "euler":
        angles = angles + deltas[:, 3:6]
    places = np.asarray(dna.neutral_joint_translations, np.float64) + deltas[:, :3]
    parents = np.asarray(dna.joint_parents)
    return world_matrices(space.rotations(angles), space.points(places), parents)[:, :3, 3]


def _near(rig: ArmatureObject, live: runtime.Runtime, layout: Board) -> _Place:
    """The position and unit of a primary board, which is beside the head meshes.

    The primary board has about 30 handles, which primary_table.py defines.
    """
    middle, unit = primary_layout.beside(*_box(lods.heads(rig), live), layout.width)
    return _Place(Vector(middle), unit)


def _box(
    items: Sequence[MeshObject], live: runtime.Runtime, joints: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lower and upper corner of the bounding box of meshes, float64[3] each.

    The box includes the joints if `joints` is True or the meshes have no vertices.
    """
    corners: list[NDArray[Any]] = []
    for item in items:
        points = np.empty(3 * len(item.data.vertices), np.float32)
        item.data.vertices.foreach_get("co", points)
        if len(points):
            corners += [points.reshape(-1, 3).min(axis=0), points.reshape(-1, 3).max(axis=0)]
    if joints or not corners:
        corners += [live.rest[:, :3, 3].min(axis=0), live.rest[:, :3, 3].max(axis=0)]
    return np.min(corners, axis=0), np.max(corners, axis=0)


def _beside(rig: ArmatureObject, live: runtime.Runtime, layout: Board) -> _Place:
    """The position and unit of a complete board.

    The board is beside the face at +x. Its height is _SHARE times the largest extent of the
    meshes and joints of the face.
    """
    low, high = _box(parts.meshes_of(rig), live, joints=True)
    size = float((high - low).max())
    unit = size * _SHARE / layout.height
    middle = (low + high) / 2
    x = high[0] + size * _AWAY + layout.width * unit / 2
    return _Place(Vector((x, float(middle[1]), float(middle[2]))), unit)


def _build(
    edit_bones: bpy.types.ArmatureEditBones,
    bars: Sequence[str],
    new: Sequence[Handle],
    layout: Board,
    middle: Vector,
) -> None:
    """Create bones in board units around the board's centre; the bone `board` scales them.

    Args:
        edit_bones: edit bones of the control armature.
        bars: the missing names of runtime.BOARD_BONES.
        new: handles without a bone.
        layout: the whole board.
        middle: centre of the board, in the space of the armature.
    """
    for name in bars:
        bone = edit_bones.new(name)
        head = middle + Vector((0.0, 0.3, 0.0)) if name == FRAMES else middle  # behind handles
        bone.head, bone.tail = head, head + Vector((0.0, 0.0, 1.0))
        bone.use_deform = False
    if FRAMES in bars:
        edit_bones[FRAMES].parent = edit_bones[BORDER]
    root = edit_bones[BORDER]
    for handle in layout.handles:
        if handle in new:
            bone = edit_bones.new(handle.bone)
            up = handle.y.way if handle.y is not None else board_layout.UP
            right = handle.x.way if handle.x is not None else (up[1], -up[0])
            x, y, z = root.head
            head = Vector((x + handle.place[0], y, z + handle.place[1]))
            bone.head, bone.tail = head, head + 0.5 * Vector((up[0], 0.0, up[1]))
            bone.align_roll((0.0, right[1] * up[0] - right[0] * up[1], 0.0))
            bone.use_deform = False
        else:
            bone = edit_bones[handle.bone]
        bone.parent = root
    if FRAMES in edit_bones:
        edit_bones[FRAMES].parent = root


def _dress(controls: ArmatureObject, layout: Board, names: Sequence[str], unit: float) -> None:
    """Set shapes, colours, limits and locks of the new bones.

    Args:
        controls: control armature with the bones.
        layout: the whole board.
        names: names of the new bones.
        unit: Blender units per board unit, the scale of the bone `board`.
    """
    name = controls.name.removesuffix("_controls")
    disc: bpy.types.Object | None = None
    for bone in controls.pose.bones:
        if bone.name in names:
            controls.data.bones[bone.name][parts.BOARD] = bone.name
            bone.use_custom_shape_bone_size = False
            bone.rotation_mode = "XYZ"
            bone.lock_scale = (True, True, True)
    if BORDER in names:
        bone = controls.pose.bones[BORDER]
        bone.custom_shape = bone_shapes.drawn(f"{name}_shape_board", layout.border)
        bone_shapes.colour(bone, _BORDER_COLOUR)
        limit = bone.constraints.new("LIMIT_SCALE")
        limit.name, limit.owner_space = board.RANGE, "LOCAL"
        for axis in "xyz":
            for end in ("min", "max"):
                setattr(limit, f"use_{end}_{axis}", True)
                setattr(limit, f"{end}_{axis}", unit)
    if FRAMES in names:
        bone = controls.pose.bones[FRAMES]
        bone.custom_shape = bone_shapes.drawn(f"{name}_shape_board_frames", layout.lines)
        bone_shapes.colour(bone, _LINE_COLOUR)
        bone.bone.hide_select = True
        bone.lock_location = bone.lock_rotation = (True, True, True)
    for handle in layout.handles:
        bone = controls.pose.bones[handle.bone]
        if handle.bone in names:
            disc = disc or _disc(controls, layout, f"{name}_shape_handle")
            bone.custom_shape = disc
            _limit(bone, handle)


def _disc(controls: ArmatureObject, layout: Board, name: str) -> bpy.types.Object:
    """The custom shape of handles: the shape of an existing handle, or a new disc."""
    bones = controls.pose.bones
    worn = (bones[handle.bone].custom_shape for handle in layout.handles)
    return next((w for w in worn if w is not None), None) or bone_shapes.disc(name)


def _limit(bone: bpy.types.PoseBone, handle: Handle) -> None:
    """Set the size, the colour, the locks and the range of the bone of a handle."""
    wide = 0.3 if handle.x is not None and handle.y is not None else 0.2
    bone.custom_shape_scale_xyz = (wide, wide, wide)
    bone_shapes.colour(bone, _SIDE_COLOURS[handle.side])
    bone.lock_location = (handle.x is None, handle.y is None, True)
    bone.lock_rotation = (True, True, True)
    bone.lock_rotation_w = True
    limit: Any = bone.constraints.new("LIMIT_LOCATION")
    limit.name, limit.owner_space, limit.use_transform_limit = board.RANGE, "LOCAL", True
    for axis, way in zip("xyz", (handle.x, handle.y, None), strict=True):
        for end in ("min", "max"):
            setattr(limit, f"use_{end}_{axis}", True)
        setattr(limit, f"min_{axis}", way.low if way is not None else 0.0)
        setattr(limit, f"max_{axis}", way.high if way is not None else 0.0)


def _show_bones(controls: ArmatureObject, names: Sequence[str]) -> None:
    """Assign bones to the board's bone collection."""
    data = controls.data
    shelf = data.collections.get(COLLECTION) or data.collections.new(COLLECTION)
    for name in names:
        shelf.assign(data.bones[name])
