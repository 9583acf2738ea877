# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds and edits the deforming armature and the control armature of a character."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ... import native
from ...language import tables
from ...logic.character import plans
from ..base import compat, parts
from ..base.blender_types import ArmatureObject, Context
from . import bone_shapes

SHELF = "Joints"  # the hidden bone collection of the deforming bones
LIVE_PROPERTIES = (parts.MAPS, parts.CHANNELS)

Point = tuple[float, float, float]
BonePlace = tuple[Point, Point, float, str]  # position, axis, length, parent's name


@contextmanager
def _edit_bones(
    context: Context, item: ArmatureObject, collection: bpy.types.Collection
) -> Iterator[bpy.types.ArmatureEditBones]:
    """Context manager: the edit bones of an armature object, which must be in no collection yet.

    Edit bones exist only in edit mode, which only an operator can enter. In scene/, only this file
    changes the mode of an object.
    """
    layer = context.view_layer
    previous = layer.objects.active
    if previous is not None and previous.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    collection.objects.link(item)
    layer.objects.active = item
    with context.temp_override(active_object=item, object=item, selected_objects=[item]):
        bpy.ops.object.mode_set(mode="EDIT")
        try:
            yield item.data.edit_bones
        finally:
            bpy.ops.object.mode_set(mode="OBJECT")
            layer.objects.active = previous
            collection.objects.unlink(item)


@contextmanager
def edit_armature(
    context: Context, data: bpy.types.Armature
) -> Iterator[bpy.types.ArmatureEditBones]:
    """Context manager: the edit bones of an existing armature, also if its objects are hidden.

    Args:
        context: its scene temporarily gets a helper object.
        data: the armature.
    """
    workshop = bpy.data.collections.new("bones")
    item = cast("ArmatureObject", bpy.data.objects.new("bones", data))
    context.scene.collection.children.link(workshop)
    try:
        with _edit_bones(context, item, workshop) as edit_bones:
            yield edit_bones
    finally:
        bpy.data.batch_remove([item, workshop])


@contextmanager
def kept_selection(context: Context) -> Iterator[None]:
    """Context manager: at the end, restore the active object, its mode and the selection."""
    layer = context.view_layer
    active = layer.objects.active
    mode = active.mode if active is not None else "OBJECT"
    selected = [o for o in layer.objects if o.select_get(view_layer=layer)]
    try:
        yield
    finally:
        layer.update()  # removes deleted objects from the list of objects
        there = {o for o in layer.objects if o is not None}
        for item in there:
            item.select_set(item in selected, view_layer=layer)
        layer.objects.active = active if active in there else None
        if active is not None and active in there and active.mode != mode:
            with context.temp_override(active_object=active, object=active):
                bpy.ops.object.mode_set(mode=mode)


def join_pose_mode(context: Context, item: ArmatureObject) -> None:
    """Put an armature into pose mode together with the active object.

    Args:
        context: its view layer has both objects.
        item: the armature; it keeps its mode if Blender refuses the change.
    """
    layer = context.view_layer
    active, layer.objects.active = layer.objects.active, item
    with context.temp_override(active_object=item, object=item):
        if bpy.ops.object.mode_set.poll():  # pyright: ignore[reportCallIssue]  wrong in the stubs
            bpy.ops.object.mode_set(mode="POSE")
    layer.objects.active = active


def enter_pose_mode(context: Context, item: ArmatureObject) -> None:
    """Make an armature active, select it alone, and enter pose mode.

    Args:
        context: its view layer shows the armature.
        item: the armature.
    """
    layer = context.view_layer
    active = layer.objects.active
    if active is not None and active != item and active.mode != "OBJECT":
        with context.temp_override(active_object=active, object=active):
            bpy.ops.object.mode_set(mode="OBJECT")
    for other in layer.objects:
        other.select_set(other == item, view_layer=layer)
    layer.objects.active = item
    if item.mode != "POSE":
        with context.temp_override(active_object=item, object=item):
            bpy.ops.object.mode_set(mode="POSE")


def build_rig(
    context: Context,
    plan: plans.CharacterPlan,
    made: list[bpy.types.ID],
    workshop: bpy.types.Collection,
) -> ArmatureObject:
    """Build the deforming armature in its neutral pose.

    Args:
        context: a Blender context with a view layer.
        plan: names, joints and meshes of the character.
        made: receives every new datablock.
        workshop: a collection in the scene, in which bones are edited.

    Returns:
        The armature object; each bone stores its joint index.
    """
    data = bpy.data.armatures.new(f"{plan.name}_rig")
    made.append(data)
    rig = cast("ArmatureObject", bpy.data.objects.new(f"{plan.name}_rig", data))
    made.append(rig)
    armature = plan.armature
    with _edit_bones(context, rig, workshop) as edit_bones:
        made_bones = {}
        for joint in armature.order:
            bone = edit_bones.new(armature.labels[joint])
            bone.head = (0.0, 0.0, 0.0)
            bone.tail = (0.0, armature.lengths[joint], 0.0)
            bone.matrix = Matrix(armature.rest[joint].tolist())
            if armature.parents[joint] >= 0:
                bone.parent = made_bones[armature.parents[joint]]
            made_bones[joint] = bone
    for joint, label in enumerate(armature.labels):
        data.bones[label][parts.JOINT] = joint
    data.display_type = "STICK"
    # Hide the bones and not the object, so that Select All and Duplicate include the object.
    shelf = data.collections.new(SHELF)
    for bone in data.bones:
        shelf.assign(bone)
    shelf.is_visible = False
    # The rig is locked because it follows the control armature (rig_placement.py). If the user
    # moved both together, the rig would move twice as far.
    lock_place(rig)
    rig[parts.MAPS] = [0.0] * max(1, len(plan.map_labels))
    rig[parts.CHANNELS] = [0.0] * max(1, plan.channel_count)
    rig[parts.PULL] = 0.0
    for name in LIVE_PROPERTIES:
        rig.property_overridable_library_set(f'["{name}"]', True)
    return rig


def pull_controls(rig: ArmatureObject, controls: ArmatureObject) -> None:
    """Add a driver to the rig so that Blender evaluates the controls even if they are hidden.

    If the rig has this driver already, its variables are only pointed at `controls`.

    Blender skips hidden objects that no visible object depends on, and the face would not move. The
    driver reads each control bone, because Blender evaluates a bone of a hidden armature only if
    something visible depends on this bone.

    Args:
        rig: the deforming armature.
        controls: the control armature; its evaluated copy must already have its bones.
    """
    data = rig.animation_data
    path = f'["{parts.PULL}"]'
    curve = data.drivers.find(path) if data else None
    if curve is None:
        curve = cast("bpy.types.FCurve", rig.driver_add(path))
        assert curve.driver is not None
        curve.driver.type = "SUM"
        for bone in controls.pose.bones:
            _pull(curve.driver, controls, bone.name)
    assert curve.driver is not None
    for variable in curve.driver.variables:
        if variable.targets[0].id != controls:
            variable.targets[0].id = controls


def _pull(driver: bpy.types.Driver, controls: ArmatureObject, bone: str) -> None:
    variable = driver.variables.new()
    variable.type = "TRANSFORMS"
    target = variable.targets[0]
    target.id, target.bone_target = controls, bone
    target.transform_type, target.transform_space = "SCALE_X", "LOCAL_SPACE"


def _pulling(rig: ArmatureObject) -> bpy.types.Driver | None:
    data = rig.animation_data
    curve = data.drivers.find(f'["{parts.PULL}"]') if data else None
    return curve.driver if curve is not None else None


def pull_more(rig: ArmatureObject, controls: ArmatureObject) -> None:
    """Extend the driver of `pull_controls` to new bones of the control armature.

    Args:
        rig: the deforming armature.
        controls: the control armature; its evaluated copy must already have its bones.
    """
    driver = _pulling(rig)
    if driver is not None:
        pulled = {variable.targets[0].bone_target for variable in driver.variables}
        for bone in controls.pose.bones:
            if bone.name not in pulled:
                _pull(driver, controls, bone.name)


def pull_less(rig: ArmatureObject, bones: Collection[str]) -> None:
    """Remove control bones from the driver of `pull_controls` before the bones are deleted.

    Args:
        rig: the deforming armature.
        bones: names of the control bones.
    """
    driver = _pulling(rig)
    for variable in list(driver.variables) if driver is not None else ():
        if driver is not None and variable.targets[0].bone_target in bones:
            driver.variables.remove(variable)


def joints_are_shown(rig: ArmatureObject) -> bool:
    """Whether a deforming armature is visible and any of its bone collections is shown."""
    return not rig.hide_viewport and any(c.is_visible for c in rig.data.collections_all)


def hide_joints(rig: ArmatureObject) -> None:
    """Hide the bones of a deforming armature by hiding its bone collections."""
    for shelf in rig.data.collections_all:
        shelf.is_visible = False
    rig.pop(parts.JOINTS_SHOWN, None)


def lock_place(item: bpy.types.Object) -> None:
    """Lock location, rotation and scale of an object against accidental moves by the user."""
    item.lock_location = item.lock_rotation = item.lock_scale = (True, True, True)
    item.lock_rotation_w = True


def build_controls(
    context: Context,
    plan: plans.CharacterPlan,
    made: list[bpy.types.ID],
    workshop: bpy.types.Collection,
) -> ArmatureObject:
    """Build the control armature with the sliders and the bones of head, neck, eyes and gaze.

    Args:
        context: a Blender context with a view layer.
        plan: names, joints, meshes and controls of the character.
        made: receives every new datablock.
        workshop: a collection in the scene, in which bones are edited.

    Returns:
        The armature object.
    """
    data = bpy.data.armatures.new(f"{plan.name}_controls")
    made.append(data)
    controls = cast("ArmatureObject", bpy.data.objects.new(f"{plan.name}_controls", data))
    made.append(controls)
    places, room = control_places(plan), outline_room(plan)
    with _edit_bones(context, controls, workshop) as edit_bones:
        for name, (position, axis, length, _parent) in places.items():
            bone = edit_bones.new(name)
            bone.head = position
            bone.tail = Vector(position) + Vector(axis) * length
            bone.use_deform = False
        for name, (_position, _axis, _length, parent) in places.items():
            if parent:
                edit_bones[name].parent = edit_bones[parent]
    for name in places:
        data.bones[name][parts.PART] = name
        bone = controls.pose.bones[name]
        bone.custom_shape = bone_shapes.make(made, plan.name, name)
        bone.use_custom_shape_bone_size = True
        bone.lock_scale = (True, True, True)
        if name != "eyes":
            bone.lock_location = (True, True, True)
        if name in ("face", "eyes"):
            bone.lock_rotation = (True, True, True)
        bone_shapes.place(bone, name, room)
    data.bones.active = data.bones[parts.FACE]
    compat.select_bone(controls.pose.bones[parts.FACE])
    controls.show_in_front = True
    controls[parts.OVERDRIVE] = False
    controls.property_overridable_library_set(f'["{parts.OVERDRIVE}"]', True)
    add_properties(controls.pose.bones[parts.FACE], plan.controls)
    return controls


def control_places(plan: plans.CharacterPlan) -> dict[str, BonePlace]:
    """Control bone -> (position of its head, direction, length, name of the parent bone).

    Positions and lengths are in Blender units, directions are unit vectors. A bone without a parent
    has "" as the parent's name.
    """
    rest, anchors, size = plan.armature.rest, plan.anchors, plan.size
    points = np.concatenate([m.positions for m in plan.meshes]).astype(float)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    head = rest[anchors.head][:3, 3] if anchors.head is not None else middle
    neck = (
        rest[anchors.neck[0]][:3, 3] if anchors.neck else np.array([middle[0], middle[1], low[2]])
    )
    up, ahead = (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)
    places = {
        "neck": (tuple(neck), up, size * 0.2, ""),
        "head": (tuple(head), up, size * 0.4, "neck"),
    }
    eyes = {}
    for side, sign in (("L", 1.0), ("R", -1.0)):
        if side in anchors.eyes:
            eyes[side] = rest[anchors.eyes[side]][:3, 3]
        else:
            eyes[side] = middle + np.array([sign * size * 0.13, -size * 0.25, 0.0])
        places[f"eye_{side}"] = (tuple(eyes[side]), ahead, size * 0.12, "head")
    between = (eyes["L"] + eyes["R"]) / 2
    target = between + np.array([0.0, -size * 1.6, 0.0])
    places["eyes"] = (tuple(target), ahead, size * 0.12, "head")
    centre, wide = _sides(points, between[2], size)
    side = (centre + wide + size * 0.2, float(middle[1]), float(between[2] - size * 0.15))
    places["face"] = (side, up, size * 0.12, "head")
    return places


def outline_room(plan: plans.CharacterPlan) -> bone_shapes.Room:
    """The extent of a face, to place outlines of bones.

    Args:
        plan: the plan of the face, for its meshes and joints.
    """
    points = np.concatenate([m.positions for m in plan.meshes]).astype(float)
    between = control_places(plan)["eyes"][0]
    middle, wide = _sides(points, between[2], plan.size)
    return bone_shapes.Room(middle, float(between[0]), wide, float(points[:, 2].max()))


def _sides(points: NDArray[np.float64], height: float, size: float) -> tuple[float, float]:
    """The x coordinate of a head's centre, and half the width of the head.

    Only vertices near the height of the eyes count, so that the shoulders are excluded.

    Args:
        points: float64[V, 3], vertices of all meshes in Blender units.
        height: z of the eyes.
        size: size of the face.
    """
    near = np.abs(points[:, 2] - height) < 0.1 * size
    # A face without skin near its eyes uses the width of the whole face.
    across = points[near if near.any() else slice(None), 0]
    return float(across.max() + across.min()) / 2, float(np.ptp(across)) / 2


def add_properties(
    bone: bpy.types.PoseBone, controls: Iterable[plans.ControlPlan], maximum: float = 1.0
) -> None:
    """Add the float property of each slider to a pose bone, with limits, default and tooltip.

    Args:
        bone: the pose bone that stores the sliders.
        controls: label, rest and lowest value of each slider.
        maximum: largest value of all sliders.
    """
    for control in controls:
        bone[control.label] = control.rest
        describe_property(bone, control, maximum)


def describe_property(bone: bpy.types.PoseBone, control: plans.ControlPlan, maximum: float) -> None:
    """Set limits, default and tooltip of one slider.

    Args:
        bone: the pose bone that stores the sliders; it has the property already.
        control: label, rest, lowest value and description of the slider.
        maximum: largest value of the slider.
    """
    name = control.label
    words: Any = bone.id_properties_ui(name)
    words.update(
        min=control.lowest,
        max=maximum,
        soft_min=control.lowest,
        soft_max=1.0,
        default=control.rest,
        step=1.0,
        precision=3,
        description=tables.controls().tooltip(name) or control.description,
    )
    bone.property_overridable_library_set(f'["{bpy.utils.escape_identifier(name)}"]', True)


def key_group(name: str) -> str:
    """The name of the F-curve group for keys of a control: the title of its region."""
    regions = native.regions()
    return regions.titles[regions.of_slider(name)]
