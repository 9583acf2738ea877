# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves a pose towards the keyframes around it (breakdown, relax, push) or towards rest."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..animation import keying
from ..base import parts
from ..base.blender_types import ArmatureObject
from ..character import runtime, sides

_AT = 1e-3  # frames: keys closer than this are at the same frame


@dataclass(frozen=True)
class Neighbours:
    """The poses at the keyframes before and after a frame.

    Attributes:
        before, after: the poses.
        share: position of the frame between the two keyframes, 0 to 1.
    """

    before: keying.Pose
    after: keying.Pose
    share: float


def key_frames(controls: ArmatureObject, paths: Collection[str] | None = None) -> list[float]:
    """The frames at which a face has keyframes, sorted and unique.

    Args:
        controls: the control armature.
        paths: data paths whose keyframes count; None: all sliders and control bones.
    """
    found = {
        round(key.co.x, 3)
        for path, curves in keying.curves_by_path(controls).items()
        if (path in paths if paths is not None else path.startswith("pose.bones"))
        for curve in curves
        for key in curve.keyframe_points
    }
    return sorted(found)


def next_key(
    controls: ArmatureObject, frame: float, forward: bool, paths: Collection[str] | None = None
) -> float | None:
    """The frame of the next or previous keyframe; None if there is no such keyframe.

    Args:
        controls: the control armature.
        frame: current frame.
        forward: True: next; False: previous.
        paths: data paths whose keyframes count; None: all sliders and control bones.
    """
    frames = key_frames(controls, paths)
    there = [f for f in frames if (f > frame + _AT if forward else f < frame - _AT)]
    return (there[0] if forward else there[-1]) if there else None


def neighbours(
    controls: ArmatureObject,
    frame: float,
    now: keying.Pose,
    paths: Collection[str],
    skipped: Collection[float] = (),
) -> Neighbours:
    """The poses at the last keyframe before a frame and at the first keyframe after the frame.

    Args:
        controls: the control armature.
        frame: current frame.
        now: current pose.
        paths: data paths whose keyframes count.
        skipped: frames whose keyframes do not count.

    Returns:
        Neighbours. If there are only earlier or only later keyframes, both poses are equal, and
        `share` is 0.5.

    Raises:
        FaceError: there is no earlier and no later keyframe.
    """
    frames = [f for f in key_frames(controls, paths) if f not in skipped]
    before = max((f for f in frames if f < frame - _AT), default=None)
    after = min((f for f in frames if f > frame + _AT), default=None)
    first, last = (
        (before if before is not None else after),
        (after if after is not None else before),
    )
    if first is None or last is None:
        raise FaceError(told("There is no key of these controls before this frame or after it."))
    share = (frame - first) / (last - first) if last > first else 0.5
    before_it, after_it = (keying.pose_at(controls, at, now) for at in (first, last))
    return Neighbours(before_it, after_it, share)


def paths_of(controls: ArmatureObject, labels: Iterable[str], bones: bool) -> set[str]:
    """The data paths of sliders and, if wanted, of control bones.

    Args:
        controls: the control armature.
        labels: names of the sliders.
        bones: whether to include the control bones.
    """
    own = {parts.property_path(label) for label in labels}
    return own | set(keying.pose_of(controls).bones) if bones else own


def selected_paths(controls: ArmatureObject) -> set[str]:
    """The data paths of the F-curves of a face that are selected in the animation editors."""
    keyed = keying.curves_by_path(controls)
    return {path for path, curves in keyed.items() if any(curve.select for curve in curves)}


def move(
    rig: ArmatureObject,
    now: keying.Pose,
    goal: keying.Pose,
    factor: float,
    paths: Collection[str],
) -> list[str]:
    """Move controls from a pose towards another one.

    Args:
        rig: the character.
        now, goal: the pose from which, and the pose towards which the controls move.
        factor: 1 reaches the goal, 0 changes nothing, below 0 moves away from the goal.
        paths: data paths of the controls to move.

    Returns:
        Names of the sliders with a path in `paths`, even if their values do not change.
    """
    controls = parts.controls_there(rig)
    values = {
        name: value + (goal.sliders[name] - value) * factor
        for name, value in now.sliders.items()
        if parts.property_path(name) in paths
    }
    sides.put(rig, values)
    for path, start in now.bones.items():
        if path in paths:
            place = controls.path_resolve(path)
            for index, value in enumerate(_blended(path, start, goal.bones[path], factor)):
                place[index] = value
    controls.update_tag()
    return list(values)


def _blended(
    path: str, start: tuple[float, ...], goal: tuple[float, ...], factor: float
) -> list[float]:
    """Mix two values of a property; quaternions are mixed along the shorter arc and normalised.

    Args:
        path: data path of the property, which tells whether the value is a quaternion.
        start, goal: components of the two values.
        factor: 0 gives `start`, 1 gives `goal`; other factors extrapolate.
    """
    if not path.endswith("rotation_quaternion"):
        return [a + (b - a) * factor for a, b in zip(start, goal, strict=True)]
    sign = -1.0 if sum(a * b for a, b in zip(start, goal, strict=True)) < 0.0 else 1.0
    mixed = [a + (sign * b - a) * factor for a, b in zip(start, goal, strict=True)]
    length = sum(part * part for part in mixed) ** 0.5 or 1.0
    return [part / length for part in mixed]


def rest_pose(rig: ArmatureObject, now: keying.Pose) -> keying.Pose:
    """The rest values of the sliders and bones that the pose `now` contains.

    Args:
        rig: the character.
        now: the pose.
    """
    live = runtime.there(rig)
    rests = dict(zip(live.labels, live.rests, strict=True))
    bones: Mapping[str, tuple[float, ...]] = {
        path: (1.0, 0.0, 0.0, 0.0)
        if path.endswith("quaternion")
        else (0.0, *values[1:])
        if path.endswith("axis_angle")
        else (0.0,) * len(values)
        for path, values in now.bones.items()
    }
    return keying.Pose({name: rests[name] for name in now.sliders}, bones)


def mixed(first: keying.Pose, second: keying.Pose, share: float) -> keying.Pose:
    """Mix two poses.

    Args:
        first, second: the poses.
        share: 0 gives the first pose, 1 the second.
    """
    return keying.Pose(
        {n: v + (second.sliders[n] - v) * share for n, v in first.sliders.items()},
        {p: tuple(_blended(p, v, second.bones[p], share)) for p, v in first.bones.items()},
    )
