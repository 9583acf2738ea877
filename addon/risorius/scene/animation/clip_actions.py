# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts clips to actions of a character's controls, and actions to clips."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Euler, Quaternion
from numpy.typing import NDArray

from ... import native
from ...logic.animation import clip_units
from ...logic.animation.bezier_keys import Bezier, Fitter, straight
from ...logic.base.sentences import Sentence, told
from ..base import compat, parts
from ..base.blender_types import Animated, ArmatureObject
from ..character import armatures, runtime, shown_keys
from . import curve_colours

LINEAR = 1  # the number of the interpolation "LINEAR"
_BEZIER = 2
_FREE = 0  # the number of the handle type "FREE"
_TURN = 0.1  # factor on the tolerance for rotations of bones, whose values are small
_ROTATIONS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}


@dataclass
class Report:
    """Result of importing a clip.

    Attributes:
        action: the new action.
        first, last: first and last frame of the action.
        curves: number of sliders and bones that the clip moves, including bones that the face
            lacks.
        unknown: names of the clip's curves that match no control or bone of this face.
        notes: sentences for the user.
    """

    action: bpy.types.Action
    first: float = 0.0
    last: float = 0.0
    curves: int = 0
    unknown: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def summary(self) -> Sentence:
        """One line with the action's name, number of curves and frame range."""
        return told(
            "{action}: {curves} curves, frames {first:g} to {last:g}",
            action=self.action.name,
            curves=self.curves,
            first=round(self.first, 1),
            last=round(self.last, 1),
        )


def frame_rate(scene: bpy.types.Scene) -> float:
    """Frames per second of a scene."""
    return scene.render.fps / scene.render.fps_base


def timing_of(
    clip: native.Clip,
    scene: bpy.types.Scene,
    start: float,
    keep_clock: bool = False,
    whole: bool = False,
) -> clip_units.Timing:
    """Place a clip in the time of a scene.

    Args:
        clip: the clip to place.
        scene: gives the frames per second.
        start: the frame of the clip's first sample; with keep_clock, the frame of second 0.
        keep_clock: count from second 0 of the clip, to keep several clips of one take in step.
        whole: True: keys on whole frames only.
    """
    origin = 0.0 if keep_clock else float(clip.start)
    return clip_units.Timing(frame_rate(scene), float(start), origin, whole)


def sliders_of(live: runtime.Runtime) -> dict[str, str]:
    """Name of a control in the DNA file, or its label in Blender -> name of its slider property.

    Args:
        live: the character's Runtime.
    """
    return clip_units.property_names(live.dna.raw_control_names, live.labels)


def make_action(
    rig: ArmatureObject,
    clip: native.Clip,
    timing: clip_units.Timing,
    name: str,
    with_eyes: bool = True,
    tolerance: float = 0.0,
) -> Report:
    """Make an action from a clip. The action is not assigned to any datablock.

    Args:
        rig: the character's deforming armature.
        clip: risorius.Clip; curves such as "head.yaw" rotate the bones of head, neck and eyes.
        timing: conversion from the clip's time to frames of the scene.
        name: name of the action.
        with_eyes: animate the eye bones too if the clip has eye rotations.
        tolerance: largest difference of a slider from the clip after the fit of Bezier keys; a
            tenth of this value for rotations of bones. 0: a linear key for each sample.

    Returns:
        The action and notes for the user.

    Raises:
        clip_units.ClipError: the clip has no frames, no curve fits this face, or a frame is outside
            Blender's range.
    """
    controls, live = parts.controls_there(rig), runtime.there(rig)
    times = clip.frame_times()
    keys = clip_units.keys_of(clip.names, clip.curves, times, timing, sliders_of(live), with_eyes)
    if not keys.controls and not keys.turns:
        what = f"none of its {len(clip.names)} curves has the name of a control of this face"
        raise clip_units.ClipError(what if clip.frame_count and clip.names else "it has no frames")
    action = bpy.data.actions.new(name)
    bag = compat.add_curves(action, controls)
    groups = _Groups(bag)
    fitter = Fitter(tolerance) if tolerance > 0.0 else None
    turn_fitter = Fitter(tolerance * _TURN) if tolerance > 0.0 else None
    for curve in keys.controls:
        made = _new(bag, groups.of_slider(curve.name), parts.property_path(curve.name), 0)
        _fill(made, curve.frames, curve.values, fitter)
    for bone, (frames, turns) in keys.turns.items():
        if bone in controls.pose.bones:
            posed = controls.pose.bones[bone]
            _add_turn(bag, groups.named(bone), posed, frames, turns, turn_fitter)
        else:
            keys.unknown.extend(n for n in clip.names if n.partition(".")[0] == bone)
    first, last = _span(timing.frames(times), timing.whole)
    report = Report(action, first, last, len(keys.controls) + len(keys.turns), keys.unknown)
    if keys.dropped:
        report.notes.append(f"{keys.dropped} samples that are no numbers were left out.")
    return report


class _Groups:
    """Groups of F-curves by name; a group is created at its first use."""

    def __init__(self, bag: bpy.types.ActionChannelbag) -> None:
        self.bag = bag
        self.made: dict[str, bpy.types.ActionGroup] = {}

    def named(self, name: str) -> bpy.types.ActionGroup:
        if name not in self.made:
            self.made[name] = self.bag.groups.new(name)
        return self.made[name]

    def of_slider(self, label: str) -> bpy.types.ActionGroup:
        """The group of a slider's region, with the colour of the region."""
        group = self.named(armatures.key_group(label))
        if group.color_set == "DEFAULT":
            curve_colours.colour_group(group, native.regions().of_slider(label))
        return group


def _span(frames: NDArray[np.float64], whole: bool) -> tuple[float, float]:
    if not len(frames):
        return 0.0, 0.0
    if whole:
        frames, _ = clip_units.onto_frames(frames[[0, -1]], np.zeros(2))
    return float(frames[0]), float(frames[-1])


def set_range(scene: bpy.types.Scene, report: Report, mode: str) -> None:
    """Adapt the frame range of a scene to an import.

    Args:
        scene: its range is changed.
        report: result of the import, with the first and last frame.
        mode: "EXTEND": the last frame of the range becomes the last frame of the animation if this
            is later; "FIT": the range becomes the range of the animation; "KEEP": the range stays.
    """
    first, last = math.floor(report.first + 1e-4), math.ceil(report.last - 1e-4)
    if mode == "FIT":
        scene.frame_start, scene.frame_end = max(0, first), max(0, last)
    elif mode == "EXTEND":
        scene.frame_end = max(scene.frame_end, last)


def _new(
    bag: bpy.types.ActionChannelbag, group: bpy.types.ActionGroup, path: str, index: int
) -> bpy.types.FCurve:
    curve = bag.fcurves.new(path, index=index)
    curve.group = group
    return curve


def _fill(
    curve: bpy.types.FCurve,
    frames: NDArray[np.float64],
    values: NDArray[np.float64],
    fitter: Fitter | None,
) -> None:
    keys = straight(frames, values) if fitter is None else fitter.keys(frames, values)
    add_keys(curve, keys, bent=fitter is not None)


def add_keys(curve: bpy.types.FCurve, keys: Bezier, bent: bool) -> None:
    """Add keys to a curve and keep its existing keys.

    Args:
        curve: F-curve of an action.
        keys: new keys, at frames where the curve has no key.
        bent: True: Bezier interpolation; False: linear.
    """
    points = curve.keyframe_points
    first, count = len(points), len(keys.co)
    points.add(count)
    kinds = {"interpolation": _BEZIER if bent else LINEAR}
    kinds |= {"handle_left_type": _FREE, "handle_right_type": _FREE}
    for name, kind in kinds.items():
        _set_from(points, name, first, np.full(count, kind, np.int32))
    places = {"co": keys.co, "handle_left": keys.left, "handle_right": keys.right}
    for name, rows in places.items():
        _set_from(points, name, first, rows.astype(np.float32).ravel())
    curve.update()


def _set_from(
    points: bpy.types.FCurveKeyframePoints, name: str, first: int, new: NDArray[Any]
) -> None:
    """Set the keyframe property `name` of all keyframes from index `first` to the end.

    Args:
        points: the keyframes of an F-curve.
        name: name of a property of a keyframe.
        first: index of the first changed keyframe.
        new: values of the property, flat.
    """
    if first:
        width = len(new) // (len(points) - first)
        whole = np.empty(len(points) * width, new.dtype)
        points.foreach_get(name, whole)
        whole[first * width :] = new
        new = whole
    points.foreach_set(name, new)


def _add_turn(
    bag: bpy.types.ActionChannelbag,
    group: bpy.types.ActionGroup,
    bone: bpy.types.PoseBone,
    frames: NDArray[np.float64],
    turns: NDArray[np.float64],
    fitter: Fitter | None,
) -> None:
    """Add F-curves of a bone's rotation, in the rotation mode of the bone.

    Args:
        bag: receives the F-curves.
        group: group of the F-curves.
        bone: bone of the control armature.
        frames: float64[n], frames of the rotations.
        turns: float64[n, 4], quaternions (w x y z) in the armature's axes.
        fitter: fits Bezier keys; None: a linear key for each rotation.
    """
    own = clip_units.near_signs(_into_bone(bone, turns))
    path = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].{rotation_path(bone)}'
    for index, values in enumerate(_as_rotation(bone.rotation_mode, own).T):
        _fill(_new(bag, group, path, index), frames, values, fitter)


def rotation_path(bone: bpy.types.PoseBone) -> str:
    """The name of the rotation property that a pose bone's rotation mode uses."""
    return _ROTATIONS.get(bone.rotation_mode, "rotation_euler")


def _into_bone(bone: bpy.types.PoseBone, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert quaternions float64[n, 4], w x y z, from the armature's axes to the bone's axes."""
    rest = np.array(bone.bone.matrix_local.to_quaternion())[None]
    back = rest * [1.0, -1.0, -1.0, -1.0]
    return clip_units.multiply(clip_units.multiply(back, turns), rest)


def _as_rotation(mode: str, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert quaternions float64[n, 4], w x y z, to values of a rotation mode.

    Args:
        mode: a value of PoseBone.rotation_mode.
        turns: the quaternions.

    Returns:
        For "QUATERNION" and "AXIS_ANGLE" float64[n, 4]: the quaternions, or angle and axis. For
        other modes float64[n, 3]: Euler angles. Angles are in radians.
    """
    if mode == "QUATERNION":
        return turns
    if mode == "AXIS_ANGLE":
        pairs = [Quaternion(turn).to_axis_angle() for turn in turns]
        return np.array([(angle, *axis) for axis, angle in pairs])
    eulers = []
    for turn in turns:
        before = (eulers[-1],) if eulers else ()
        eulers.append(Quaternion(turn).to_euler(mode, *before))
    return np.array([tuple(e) for e in eulers])


def play(rig: ArmatureObject, action: bpy.types.Action) -> bpy.types.Action | None:
    """Make an action the active action of a character.

    Args:
        rig: deforming armature of the character.
        action: any action; of an action with slots, the slot for the control armature is played.

    Returns:
        The earlier action, which gets a fake user; None if there was none, or if it was `action`.
    """
    controls = parts.controls_there(rig)
    data = controls.animation_data_create()
    before = data.action
    if before is not None and before != action:
        before.use_fake_user = True
    compat.assign_action(data, action, compat.slot_for(action, controls))
    shown_keys.show(controls, [c.data_path for c in compat.curves_for(action, controls)])
    return before if before != action else None


def add_strip(rig: ArmatureObject, action: bpy.types.Action, name: str = "") -> bpy.types.NlaStrip:
    """Add an action as a strip of a new NLA track, at the frames of the action.
    The frames are the manual frame range of the action, or else the range from its first to its
    last key; the strip is at least one frame long, and holds its last frame.

    Args:
        rig: deforming armature of the character.
        action: any action.
        name: name of the track and the strip; "": the name of the action.

    Returns:
        The strip.
    """
    controls = parts.controls_there(rig)
    track = controls.animation_data_create().nla_tracks.new()
    track.name = name or action.name
    first, last = action.frame_range
    strip = track.strips.new(track.name, int(np.floor(first)), action)
    if hasattr(strip, "action_slot"):
        strip.action_slot = compat.slot_for(action, controls)
    strip.action_frame_start, strip.action_frame_end = first, max(last, first + 1.0)
    strip.frame_start, strip.frame_end = first, max(last, first + 1.0)
    strip.extrapolation = "HOLD_FORWARD"
    return strip


def clip_of_action(
    controls: ArmatureObject,
    live: runtime.Runtime,
    action: bpy.types.Action,
    frames: NDArray[np.float64],
    rate: float,
) -> native.Clip:
    """Sample an action as a clip.

    Args:
        controls: the control armature of the face.
        live: the character's Runtime.
        action: the action to sample.
        frames: float64[n], ascending frames of the action.
        rate: frames per second of the scene; frame 0 is second 0 of the clip.

    Returns:
        A clip with curves of the animated sliders by their property names, and of
        animated control bones and gaze target by the names in `clip_units.BONES`.
    """
    frames = np.asarray(frames, np.float64)
    curves = {(c.data_path, c.array_index): c for c in playing_curves(action, controls)}
    rows, found = [], []
    for label in live.labels:
        curve = curves.get((parts.property_path(label), 0))
        if curve is not None:
            found.append(label)
            rows.append(sampled(curve, frames))
    for name, angles in clip_units.TURNS.items():
        bone = controls.pose.bones.get(name)
        way = turning(bone, curves)
        if bone is not None and way is not None:
            found += angles
            rows += list(angles_in_armature(bone, way.mode, way.values(frames)).T[: len(angles)])
    target = [curves.get(('pose.bones["eyes"].location', axis)) for axis in range(3)]
    if any(target):
        found += clip_units.TARGET
        rows += _rows(target, (0.0, 0.0, 0.0), frames)
    return native.module().Clip(
        found,
        np.array(rows, np.float32).reshape(len(rows), len(frames)),
        rate,
        times=frames / rate,
        metadata={"source": action.name},
    )


def dna_names(live: runtime.Runtime, names: Iterable[str]) -> list[str]:
    """Replace Blender's shortened slider names by DNA names, which other characters know too.

    If several sliders have the same DNA name, only the first slider gets it, and the others keep
    Blender's names. Names that belong to no slider stay.

    Args:
        live: the character's Runtime.
        names: Blender's property names of sliders, and other names.

    Returns:
        One name for each given name, in the same order.
    """
    own = {}
    for label, name in zip(live.labels, live.dna.raw_control_names, strict=True):
        own[label] = label if name in own.values() else name
    return [own.get(name, name) for name in names]


def sampled(curve: bpy.types.FCurve, frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64[n]: the values of an F-curve at frames."""
    if is_bent(curve) or not len(curve.keyframe_points):
        return np.array([curve.evaluate(frame) for frame in frames])
    return np.interp(frames, *key_points(curve))  # fifty times as fast as evaluate()


def key_points(curve: bpy.types.FCurve) -> NDArray[np.float32]:
    """Frames and values of an F-curve's keys, float32[2, keys]."""
    points = np.empty(len(curve.keyframe_points) * 2, np.float32)
    curve.keyframe_points.foreach_get("co", points)
    return points.reshape(-1, 2).T


def is_bent(curve: bpy.types.FCurve) -> bool:
    """Whether an F-curve has modifiers, interpolation other than linear, or extrapolation other
    than constant."""
    if len(curve.modifiers) or curve.extrapolation != "CONSTANT":
        return True
    kinds = np.empty(len(curve.keyframe_points), np.int32)
    curve.keyframe_points.foreach_get("interpolation", kinds)
    return bool((kinds[:-1] != LINEAR).any())


def playing_curves(action: bpy.types.Action, owner: Animated) -> list[bpy.types.FCurve]:
    """The F-curves of an action that move a datablock. Muted curves and groups are left out.

    Args:
        action: any action.
        owner: the object or the shape keys; of an action with slots, only the slot of this
            owner is read.
    """
    return [
        c for c in compat.curves_for(action, owner) if not (c.mute or (c.group and c.group.mute))
    ]


@dataclass(frozen=True)
class Turning:
    """The rotation of a control bone in an action.

    Attributes:
        mode: rotation mode of the curves; it may differ from the mode of the bone.
        path: data path of the rotation property of this mode.
        curves: one F-curve for each component; None for a component without a curve.
        rest: components of the rest rotation.
    """

    mode: str
    path: str
    curves: list[bpy.types.FCurve | None]
    rest: tuple[float, ...]

    def values(self, frames: NDArray[np.float64]) -> NDArray[np.float64]:
        """float64[frames, 3 or 4]: the rotation; components without a curve have rest values."""
        return np.stack(_rows(self.curves, self.rest, frames), axis=1)


def turning(
    bone: bpy.types.PoseBone | None, curves: Mapping[tuple[str, int], bpy.types.FCurve]
) -> Turning | None:
    """The curves that rotate a control bone; None if there are none.

    Args:
        bone: pose bone of the control armature; None gives None.
        curves: F-curves of an action, by data path and index.
    """
    # Curves of the bone's current rotation mode are preferred. The other modes are tried because
    # the action may come from a face whose bones use another mode.
    if bone is None:
        return None
    for mode in (bone.rotation_mode, "QUATERNION", "XYZ", "AXIS_ANGLE"):
        way = turning_in(bone, mode, curves)
        if any(way.curves):
            return way
    return None


def turning_in(
    bone: bpy.types.PoseBone, mode: str, curves: Mapping[tuple[str, int], bpy.types.FCurve]
) -> Turning:
    """The curves that rotate a control bone in one rotation mode.

    Args:
        bone: pose bone of the control armature.
        mode: a value of PoseBone.rotation_mode.
        curves: F-curves of an action, by data path and index.
    """
    name = bpy.utils.escape_identifier(bone.name)
    path = f'pose.bones["{name}"].{_ROTATIONS.get(mode, "rotation_euler")}'
    rests = {"QUATERNION": (1.0, 0.0, 0.0, 0.0), "AXIS_ANGLE": (0.0, 0.0, 1.0, 0.0)}
    rest = rests.get(mode, (0.0, 0.0, 0.0))
    return Turning(mode, path, [curves.get((path, i)) for i in range(len(rest))], rest)


def _rows(
    curves: Sequence[bpy.types.FCurve | None], rest: Sequence[float], frames: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """float64[frames] for each component of a property, sampled from its F-curve.

    A component without an F-curve has its value from `rest` at all frames.
    """
    return [
        np.full(len(frames), still) if curve is None else sampled(curve, frames)
        for curve, still in zip(curves, rest, strict=True)
    ]


def angles_in_armature(
    bone: bpy.types.PoseBone, mode: str, values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """float64[n, 3]: yaw, pitch and roll in the armature's axes, radians.

    Args:
        bone: a control bone.
        mode: a value of PoseBone.rotation_mode.
        values: float64[n, 3 or 4], the bone's rotation property in this mode.
    """
    return clip_units.angles_of(_from_bone(bone, _from_rotation(mode, values)))


def rotation_of(
    bone: bpy.types.PoseBone, mode: str, angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """float64[n, 3 or 4]: values of a bone's rotation property, from angles in the armature's axes.

    Args:
        bone: a control bone.
        mode: a value of PoseBone.rotation_mode.
        angles: float64[n, 3], yaw, pitch and roll in radians.
    """
    return _as_rotation(mode, _into_bone(bone, clip_units.quaternions(angles)))


def _from_rotation(mode: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    if mode == "QUATERNION":
        return values / np.linalg.norm(values, axis=1, keepdims=True).clip(1e-12)
    if mode == "AXIS_ANGLE":
        return np.array([Quaternion(v[1:], v[0])[:] for v in values])
    return np.array([Euler(v, mode).to_quaternion()[:] for v in values])


def _from_bone(bone: bpy.types.PoseBone, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    rest = np.array(bone.bone.matrix_local.to_quaternion())[None]
    return clip_units.multiply(clip_units.multiply(rest, turns), rest * [1.0, -1.0, -1.0, -1.0])


def add_sound(
    scene: bpy.types.Scene, path: str | Path, frame: float, name: str = ""
) -> bpy.types.SoundStrip:
    """Add a sound strip to the sequencer, on the first channel on which no strip ends later than
    the start of the sound; on channel 128 if there is no such channel.

    Args:
        scene: the scene.
        path: path of the sound file.
        frame: frame of the first sample, rounded to a whole frame.
        name: name of the strip; "": the name of the file.

    Returns:
        The strip.

    Raises:
        clip_units.ClipError: Blender cannot read the file.
    """
    strips = compat.strips_of(scene)
    start = round(frame)
    try:
        made = strips.new_sound(name or Path(path).stem, str(path), _free(strips, start), start)
    except RuntimeError as error:
        said = str(error).strip().removeprefix("Error: ")
        raise clip_units.ClipError(told("no sound strip was added: {said}", said=said)) from error
    strip = cast("bpy.types.SoundStrip", made)
    sound = strip.sound
    if strip.frame_final_duration <= 1 and (sound is None or not sound.samplerate):
        strips.remove(strip)
        raise clip_units.ClipError(
            told("no sound strip was added: Blender cannot read the sound file")
        )
    return strip


def _free(strips: Iterable[bpy.types.Strip], start: int) -> int:
    """The first channel whose strips all end at or before a frame; 128 if there is none."""
    taken = {s.channel for s in strips if s.frame_final_end > start}
    return next(c for c in range(1, 129) if c not in taken or c == 128)
