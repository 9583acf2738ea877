# SPDX-License-Identifier: GPL-3.0-or-later
"""Inserts keyframes (keys) by Blender's settings: auto-key, keying set, only needed, key type.

Code that moves sliders or control bones for the animator does so in a function that it passes to
`by_hand`, or calls `changed` after the move. While a tweak is on, edits go into its additive layer.
Either the sliders or the face board lead, that is, move the face. A leading board replaces only the
sliders that its handles can move.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import compat, parts
from ..base.blender_types import ArmatureObject, Context
from ..character import armatures, board, runtime, shown_keys
from . import clip_actions, curve_colours, tweaks

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import (
        BeztripleInterpolationModeItems,
        BeztripleKeyframeTypeItems,
        KeyframeHandleTypeItems,
    )

_NEAR = 1e-6  # values that differ by no more count as equal
_AT = 1e-3  # frames that differ by less count as equal


@dataclass(frozen=True)
class Rules:
    """Blender's settings for new keys.

    Attributes:
        insert: whether keys are inserted at all.
        replace: only replace existing keys at the frame.
        available: key only properties with an F-curve.
        needed: key only if the value differs from the curve.
        kind: type of the key, such as KEYFRAME or EXTREME.
        interpolation, handles: interpolation and handle types of the first two keys of a curve; a
            later key copies the key before it.
        keying_set: key only the paths of this set; None: no limit.
    """

    insert: bool = True
    replace: bool = False
    available: bool = False
    needed: bool = False
    kind: BeztripleKeyframeTypeItems = "KEYFRAME"
    interpolation: BeztripleInterpolationModeItems = "BEZIER"
    handles: KeyframeHandleTypeItems = "AUTO_CLAMPED"
    keying_set: bpy.types.KeyingSet | None = None


@dataclass(frozen=True)
class Pose:
    """A pose of a face: the values of the controls that an animator can set.

    Attributes:
        sliders: values by name.
        bones: data path of a control bone's rotation or location -> its components.
    """

    sliders: Mapping[str, float]
    bones: Mapping[str, tuple[float, ...]]


def rules_of(context: Context, auto: bool = True, exact: bool = False) -> Rules:
    """The rules for new keys, from the settings of the scene and the preferences.

    Args:
        context: has the scene and the preferences.
        auto: True: rules of auto-key; False: rules of an explicit insert.
        exact: True: ignore the setting "Only Insert Needed", so that all controls of a pose get
            keys.
    """
    tools, edit = context.scene.tool_settings, context.preferences.edit
    needed = getattr(edit, "use_keyframe_insert_needed", False)
    if auto:
        needed = getattr(edit, "use_auto_keyframe_insert_needed", needed)
    only_set = auto and tools.use_keyframe_insert_keyingset
    return Rules(
        insert=tools.use_keyframe_insert_auto if auto else True,
        replace=auto and tools.auto_keying_mode == "REPLACE_KEYS",
        available=auto and getattr(edit, "use_keyframe_insert_available", False),
        needed=needed and not exact,
        kind=tools.keyframe_type,
        interpolation=edit.keyframe_new_interpolation_type,
        handles=edit.keyframe_new_handle_type,
        keying_set=context.scene.keying_sets_all.active if only_set else None,
    )


def pose_of(controls: ArmatureObject) -> Pose:
    """The current values of the controls, without the effect of animation layers.

    If the face board leads, the pose has the handles of the board instead of the sliders that
    these handles move.
    """
    rig = parts.rig_of(controls)
    assert rig is not None
    face = controls.pose.bones[parts.FACE]
    live = runtime.there(rig)
    reached, handles = _led(controls, live)
    sliders = {n: float(face[n]) for n in live.labels if n in face and n not in reached}
    idle = set() if reached else handles
    bones = {
        path: tuple(controls.path_resolve(path))
        for bone in controls.pose.bones
        if bone.name not in idle and bone.name not in runtime.BOARD_BONES
        for path in _paths_of(bone)
    }
    return Pose(sliders, bones)


def _led(controls: ArmatureObject, live: runtime.Runtime) -> tuple[set[str], set[str]]:
    """The sliders that the face board moves, and the bones of all its handles.

    If the sliders lead, the first set is empty.
    """
    handles = {handle.bone for handle in live.handles}
    if not board.leads(controls, live):
        return set(), handles
    led = zip(live.labels, live.table.reached, strict=True)
    return {label for label, reached in led if reached}, handles


def _paths_of(bone: bpy.types.PoseBone) -> list[str]:
    """Data paths of a bone's rotation and location, each left out if all its axes are locked."""
    names = [] if all(bone.lock_rotation) else [clip_actions.rotation_path(bone)]
    names += [] if all(bone.lock_location) else ["location"]
    return [f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].{name}' for name in names]


def curves_by_path(controls: ArmatureObject) -> dict[str, list[bpy.types.FCurve]]:
    """Data path -> F-curves of this path in the active action of the controls."""
    data = controls.animation_data
    found: dict[str, list[bpy.types.FCurve]] = {}
    if data is not None and data.action is not None:
        for curve in compat.curves_for(data.action, controls):
            found.setdefault(curve.data_path, []).append(curve)
    return found


def by_hand(
    context: Context,
    rig: ArmatureObject,
    move: Callable[[], Collection[str] | None],
    at_selected: bool = False,
    at: Callable[[float], object] | None = None,
) -> int:
    """Move controls and key them by the user's settings, as if the user had moved them.

    Args:
        context: has the settings and the current frame.
        rig: the character.
        move: a function that moves sliders and bones from their current values. It returns the
            names of all sliders that it set, even to equal values; None if it did nothing. At the
            current frame, a slider that was set to an equal value is keyed if it has an F-curve.
        at_selected: True: move at every frame with a selected key of this face, and key all
            changes; False: move at the current frame.
        at: a function that is called before each move; its argument is the frame of the move.

    Returns:
        The number of keyed properties.

    Raises:
        FaceError: with at_selected, no key is selected or a tweak is active; without it, an active
            tweak does not include the current frame, or is too weak there for a large rotation.
            The controls then have their earlier values.
    """
    controls = parts.controls_there(rig)
    shown_keys.show_some(controls)
    if at_selected:
        return _at_selected(context, controls, move, at)
    if at is not None:
        at(context.scene.frame_current_final)
    before = pose_of(controls)
    touched = move()
    if touched is None:
        return 0
    labels, paths = _moved(before, pose_of(controls))
    keyed = curves_by_path(controls)
    held = [
        n
        for n in touched
        if n in before.sliders and n not in labels and parts.property_path(n) in keyed
    ]
    led = [n for n in touched if n not in before.sliders]
    places = [board.path_of(h.bone) for h in board.handles_of_labels(rig, led)] if led else []
    held_paths = [path for path in places if path in keyed and path not in paths]
    try:
        return changed(context, rig, [*labels, *held], [*paths, *held_paths])
    except FaceError:
        show(controls, before)
        raise


def changed(
    context: Context, rig: ArmatureObject, labels: Iterable[str], bones: Iterable[str] = ()
) -> int:
    """Key the changes of an edit at the current frame if auto-key is on.

    While a tweak is on, the changes go into the tweak instead.

    Args:
        context: has the settings and the frame.
        rig: the character.
        labels: changed sliders.
        bones: data paths of the moved control bones' rotations and locations.

    Returns:
        The number of keyed properties.

    Raises:
        FaceError: the active tweak does not include the current frame, or is too weak there for a
            large rotation.
    """
    rules, controls = rules_of(context), parts.controls_there(rig)
    if tweaks.of(controls) is not None:
        return tweaks.take(controls, labels, context.scene.frame_current_final, bones)
    if not rules.insert:
        return 0
    return insert(controls, labels, bones, context.scene.frame_current, rules)


def key(
    context: Context, rig: ArmatureObject, labels: Iterable[str], bones: Iterable[str] = ()
) -> int:
    """Key controls at the current frame even if auto-key is off; an active tweak gets the keys.

    Args:
        context: has the settings and the frame.
        rig: the character.
        labels: names of the sliders to key.
        bones: data paths of the rotations and locations of control bones to key.

    Returns:
        The number of keyed properties.

    Raises:
        FaceError: the active tweak does not include the current frame, or is too weak there for a
            large rotation.
    """
    controls, rules = parts.controls_there(rig), rules_of(context, auto=False)
    if tweaks.of(controls) is not None:
        frame = context.scene.frame_current_final
        return tweaks.take(controls, labels, frame, bones, held=True)
    return insert(controls, labels, bones, context.scene.frame_current, rules)


def _moved(before: Pose, after: Pose) -> tuple[list[str], list[str]]:
    """The names of sliders and the data paths of bones whose values differ between two poses."""
    labels = [n for n, v in after.sliders.items() if abs(v - before.sliders.get(n, v)) > _NEAR]
    paths = [
        path
        for path, values in after.bones.items()
        if path in before.bones
        and max(abs(a - b) for a, b in zip(values, before.bones[path], strict=True)) > _NEAR
    ]
    return labels, paths


def selected_frames(controls: ArmatureObject) -> list[float]:
    """The frames of selected keys of sliders and bones in the face's active action, ascending."""
    found = {
        round(key.co.x, 3)
        for path, curves in curves_by_path(controls).items()
        if path.startswith("pose.bones")
        for curve in curves
        for key in curve.keyframe_points
        if key.select_control_point
    }
    return sorted(found)


def pose_at(controls: ArmatureObject, frame: float, now: Pose) -> Pose:
    """The pose of the controls' action at a frame; controls without curves keep their value.

    Args:
        controls: the control armature.
        frame: frame of the action; need not be whole.
        now: the current pose.
    """
    keyed = curves_by_path(controls)
    sliders = dict(now.sliders)
    for name in sliders:
        for curve in keyed.get(parts.property_path(name), ()):
            sliders[name] = curve.evaluate(frame)
    bones = {}
    for path, values in now.bones.items():
        numbers = list(values)
        for curve in keyed.get(path, ()):
            numbers[curve.array_index] = curve.evaluate(frame)
        bones[path] = tuple(numbers)
    return Pose(sliders, bones)


def show(controls: ArmatureObject, pose: Pose) -> None:
    """Set the controls to a pose.

    Args:
        controls: the control armature.
        pose: from pose_of or pose_at.
    """
    face = controls.pose.bones[parts.FACE]
    for name, value in pose.sliders.items():
        face[name] = value
    for path, values in pose.bones.items():
        place = controls.path_resolve(path)
        for index, value in enumerate(values):
            place[index] = value
    controls.update_tag()


def _at_selected(
    context: Context,
    controls: ArmatureObject,
    move: Callable[[], Collection[str] | None],
    at: Callable[[float], object] | None,
) -> int:
    """Move controls at every frame with a selected key of the face, and key the changed controls.

    Args:
        context: has the settings and the current frame.
        controls: control armature of the face.
        move: a function that moves sliders and bones from the pose of the frame; it returns None if
            it did nothing.
        at: a function that is called with the frame before each move; None: no function.

    Returns:
        The number of keyed properties.

    Raises:
        FaceError: no key is selected, or a tweak is active.
    """
    if tweaks.of(controls) is not None:
        raise FaceError(told("A tweak is on: end the tweak first, or work at the current frame."))
    frames = selected_frames(controls)
    if not frames:
        raise FaceError(told("Select keys of this face first: there is no selected key."))
    now, rules, made = pose_of(controls), rules_of(context, auto=False), []
    # Compute the poses of all frames before any key is inserted, because the first key of a new
    # curve sets its value at all frames.
    for frame in frames:
        before = pose_at(controls, frame, now)
        show(controls, before)
        if at is not None:
            at(frame)
        touched = move()
        after = pose_of(controls)
        if touched is not None:
            made.append((frame, after, *_moved(before, after)))
    count = 0
    for frame, after, labels, paths in made:
        show(controls, after)
        count += insert(controls, labels, paths, frame, rules)
    show(controls, pose_at(controls, context.scene.frame_current_final, now))
    return count


def insert(
    controls: ArmatureObject,
    labels: Iterable[str],
    bones: Iterable[str],
    frame: float,
    rules: Rules,
) -> int:
    """Insert keys with the current values of the controls.

    Args:
        controls: the control armature.
        labels: sliders to key. If the face board leads, the handles that move these sliders are
            keyed instead.
        bones: data paths of bones to key.
        frame: frame of the scene; need not be whole.
        rules: settings for new keys; properties that they exclude, and properties with drivers, get
            no key. `rules.insert` is not read.

    Returns:
        The number of keyed properties.
    """
    keyed, driven = curves_by_path(controls), _driven(controls)
    done = []
    for path, group, axes in _wanted(controls, labels, bones):
        curves = keyed.get(path, [])
        if path in driven or not _may(controls, path, curves, frame, rules):
            continue
        for index in axes:
            controls.keyframe_insert(
                path, index=index, frame=frame, group=group, keytype=rules.kind
            )
        done.append(path)
        data = controls.animation_data
        assert data is not None
        assert data.action is not None
        bag = compat.bag_for(data.action, controls)
        if not curves and bag is not None:
            curves = _new_curves(bag, path)
        for curve in curves:
            _finish(curve, rules)
    if done:
        shown_keys.show(controls, done)
    return len(done)


def _wanted(
    controls: ArmatureObject, labels: Iterable[str], bones: Iterable[str]
) -> list[tuple[str, str, list[int]]]:
    """Data path, curve group and array indices (-1: all) of each property to key.

    Instead of a slider that the face board moves, the handle that moves it is keyed, on the axes
    on which the handle can move.
    """
    rig = parts.rig_of(controls)
    assert rig is not None
    live = runtime.there(rig)
    reached, _handles = _led(controls, live)
    asked = list(labels)
    led = board.handles_of_labels(rig, [n for n in asked if n in reached]) if reached else []
    paths = dict.fromkeys([*bones, *(board.path_of(handle.bone) for handle in led)])
    found = [(parts.property_path(n), armatures.key_group(n), [-1]) for n in asked]
    wanted = [row for row, name in zip(found, asked, strict=True) if name not in reached]
    by_path = {board.path_of(handle.bone): handle for handle in live.handles}
    titles = native.regions().titles
    for path in paths:
        handle = by_path.get(path)
        if handle is None:
            wanted.append((path, path.split('"')[1], [-1]))
            continue
        axes = [axis for axis, way in enumerate((handle.x, handle.y)) if way is not None]
        wanted.append((path, titles[handle.region], axes))
    return wanted


def _driven(controls: ArmatureObject) -> set[str]:
    data = controls.animation_data
    return {curve.data_path for curve in data.drivers} if data is not None else set()


def _new_curves(bag: bpy.types.ActionChannelbag, path: str) -> list[bpy.types.FCurve]:
    """The F-curves of a property that was just keyed; curves of sliders get their region's colour.

    Args:
        bag: contains the F-curves of the action.
        path: data path of the property.
    """
    curves = [c for c in (bag.fcurves.find(path, index=i) for i in range(4)) if c is not None]
    label = curve_colours.label_of(path)
    if label:
        for curve in curves:
            curve_colours.colour_curve(curve, label)
    return curves


def _finish(curve: bpy.types.FCurve, rules: Rules) -> None:
    """Set interpolation and handle types of a curve's last key, if it has at most two keys.

    Blender copies both settings to later keys from the key before.
    """
    if len(curve.keyframe_points) > 2:
        return  # Blender copied both settings from the previous key
    for key in (
        curve.keyframe_points[-1:] if len(curve.keyframe_points) > 1 else curve.keyframe_points
    ):
        key.interpolation = rules.interpolation
        key.handle_left_type = key.handle_right_type = rules.handles
    curve.update()


def _may(
    controls: ArmatureObject,
    path: str,
    curves: Collection[bpy.types.FCurve],
    frame: float,
    rules: Rules,
) -> bool:
    """Whether the rules allow a key of a property at a frame."""
    if rules.keying_set is not None and not in_set(controls, rules.keying_set, path):
        return False
    if not curves:
        return not (rules.available or rules.replace)
    if rules.replace and not any(_key_at(curve, frame) for curve in curves):
        return False
    return not rules.needed or any(
        abs(curve.evaluate(frame) - _value(controls, path, curve.array_index)) > _NEAR
        or curve.is_empty
        for curve in curves
    )


def _key_at(curve: bpy.types.FCurve, frame: float) -> bool:
    return any(abs(key.co.x - frame) < _AT for key in curve.keyframe_points)


def _value(controls: ArmatureObject, path: str, index: int) -> float:
    value = controls.path_resolve(path)
    return float(value if isinstance(value, (bool, int, float)) else value[index])


def in_set(controls: ArmatureObject, keying_set: bpy.types.KeyingSet, path: str) -> bool:
    """Whether a keying set contains a property of the controls.

    Args:
        controls: the control armature.
        keying_set: a keying set of the scene with paths, or a built-in keying set, whose bl_idname
            tells which properties the set keys.
        path: data path of the property.
    """
    if keying_set.is_path_absolute:
        return any(p.id == controls and p.data_path == path for p in keying_set.paths)
    name = keying_set.bl_idname
    if "Character" in name or "Available" in name:
        return "Character" in name or path in curves_by_path(controls)
    if path.endswith('"]'):
        return "CProp" in name
    return "Delta" not in name and ("Loc" if path.endswith("location") else "Rot") in name
