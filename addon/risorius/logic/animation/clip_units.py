# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts a clip's seconds and radians to Blender's frames and quaternions, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..base.errors import FaceError
from ..base.sentences import told

Float = NDArray[np.float64]
HEAD = ("head.yaw", "head.pitch", "head.roll")
NECK = ("neck.yaw", "neck.pitch", "neck.roll")
EYES = {"L": ("eyeL.yaw", "eyeL.pitch"), "R": ("eyeR.yaw", "eyeR.pitch")}
# Names of a clip's curves with the offset of the gaze target from its rest place, in Blender units
# and in the axes of the target's bone.
TARGET = ("eyes.x", "eyes.y", "eyes.z")
TURNS = {"head": HEAD, "neck": NECK, **{f"eye_{side}": names for side, names in EYES.items()}}
BONES = (*(name for names in TURNS.values() for name in names), *TARGET)  # curves that move bones
LAST_FRAME = 1_048_574  # Blender's own limit of a scene


class ClipError(FaceError):
    """A clip cannot become an action, or an action contains no control of this face."""


@dataclass(frozen=True)
class Timing:
    """The conversion from a clip's time to Blender's frames.

    Attributes:
        rate: frames per second of the scene, fps / fps_base.
        start: frame of the scene at the clip's time `origin`.
        origin: time in seconds on the clip's clock.
        whole: True: keys are placed on whole frames of the scene only. A sample between two whole
            frames gives a key on each of them.
    """

    rate: float
    start: float = 1.0
    origin: float = 0.0
    whole: bool = False

    def frames(self, seconds: Float) -> Float:
        """Frames of the scene, with fractions, for seconds on the clip's clock."""
        return self.start + (np.asarray(seconds, np.float64) - self.origin) * self.rate

    def seconds(self, frames: Float) -> Float:
        """Seconds on the clip's clock for frames of the scene; the inverse of `frames`."""
        return self.origin + (np.asarray(frames, np.float64) - self.start) / self.rate

    def placed(self, frames: Float, values: Float) -> tuple[Float, Float]:
        """Frames and values of keys: unchanged, or on whole frames if `whole` is True.

        Args:
            frames: float[keys], frames of the scene.
            values: float[keys], or [keys, n].
        """
        return onto_frames(frames, values) if self.whole else (frames, values)


def onto_frames(frames: Float, values: Float) -> tuple[Float, Float]:
    """Convert samples at any time to keys on whole frames.

    A sample between two whole frames gives a key on each of them. So there are
    at most twice as many keys as samples, even if pauses between samples are long. At every whole
    frame, straight lines between keys have the values of straight lines between samples.

    Args:
        frames: float64[n], ascending; frames within a ten thousandth of a whole frame are rounded
            to it.
        values: float64[n] or float64[n, width].

    Returns:
        Whole frames float64[m] and the values there. Frames before the first sample or after the
        last one get the value of that sample.
    """
    near = np.rint(frames)
    frames = np.where(np.abs(frames - near) < 1e-4, near, frames)
    whole = np.unique(np.concatenate([np.floor(frames), np.ceil(frames)]))
    columns = [np.interp(whole, frames, column) for column in values.reshape(len(frames), -1).T]
    return whole, np.stack(columns, axis=1).reshape(len(whole), *values.shape[1:])


@dataclass
class Curve:
    """Keys of one F-curve: frames and values, float64[n] each; one key if all values are equal.

    Attributes:
        name: property name of the slider.
    """

    name: str
    frames: Float
    values: Float


@dataclass
class Keys:
    """The keys of the action that is made from a clip.

    Attributes:
        controls: keys of the sliders, by their property names.
        turns: bone -> frames float64[n] and unit quaternions float64[n, 4], w first, in the axes of
            the control armature.
        unknown: names of curves in the clip that are neither a control of this face nor an angle of
            a bone.
        dropped: number of samples that were left out because they were not finite. The angles of a
            bone at one frame count as one sample.
    """

    controls: list[Curve] = field(default_factory=list)
    turns: dict[str, tuple[Float, Float]] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)
    dropped: int = 0


def property_names(dna_names: Sequence[str], labels: Sequence[str]) -> dict[str, str]:
    """Map the name of a clip's curve to the property name of the slider that it drives.

    A curve may be named like a control in the DNA file or like the control's label in Blender. If
    the DNA file contains a name twice, the curve drives the first control of that name.

    Args:
        dna_names: names of the controls in the DNA file.
        labels: Blender's names of the same controls, which are shortened and unique.
    """
    found = dict(zip(reversed(dna_names), reversed(labels), strict=True))
    found.update(zip(labels, labels, strict=True))
    return found


def keys_of(
    names: Sequence[str],
    curves: NDArray[np.float32],
    times: Float,
    timing: Timing,
    sliders: dict[str, str],
    with_eyes: bool = True,
) -> Keys:
    """Convert a clip to keys.

    Args:
        names: names of the clip's curves.
        curves: float32[names, frames].
        times: float64[frames], seconds, ascending.
        timing: conversion from the clip's time to frames of the scene.
        sliders: name of a clip's curve -> property name of the slider that the curve drives.
        with_eyes: True: curves of eye rotation become keys too.

    Returns:
        Keys. Samples that are not finite are left out; a curve without finite samples has no keys.

    Raises:
        ClipError: frames of the clip lie outside Blender's range.
    """
    frames = timing.frames(times)
    if frames.size and not np.abs(frames).max() <= LAST_FRAME:
        worst = frames[np.argmax(np.abs(frames))]
        raise ClipError(
            told(
                ("frame {worst:.0f} is beyond what Blender can play (at most frame {last_frame})"),
                worst=worst,
                last_frame=LAST_FRAME,
            )
        )
    keys = Keys()
    angles = {name for group in TURNS.values() for name in group}
    for name, values in zip(names, curves, strict=True):
        if name in sliders:
            curve = _curve(sliders[name], frames, values, timing, keys)
            if curve is not None:
                keys.controls.append(curve)
        elif name not in angles:
            keys.unknown.append(name)
    _add_turns(keys, names, curves, frames, timing, with_eyes)
    return keys


def _curve(
    name: str, frames: Float, values: NDArray[np.float32], timing: Timing, keys: Keys
) -> Curve | None:
    good = np.isfinite(values)
    if not good.all():
        keys.dropped += int(len(values) - good.sum())
        frames, values = frames[good], values[good]
    if not len(values):
        return None
    if (values == values[0]).all():
        frames, values = frames[:1], values[:1]
        return Curve(name, np.floor(frames) if timing.whole else frames, values.astype(np.float64))
    return Curve(name, *timing.placed(frames, values.astype(np.float64)))


def _add_turns(
    keys: Keys,
    names: Sequence[str],
    curves: NDArray[np.float32],
    frames: Float,
    timing: Timing,
    with_eyes: bool,
) -> None:
    rows = dict(zip(names, curves, strict=True))
    for bone, group in TURNS.items():
        if bone.startswith("eye_") and not with_eyes:
            continue
        if not len(frames) or not any(name in rows for name in group):
            continue
        nothing = np.zeros(len(frames), np.float32)
        angles = np.stack([rows.get(n, nothing) for n in group], axis=1).astype(np.float64)
        good = np.isfinite(angles).all(axis=1)
        keys.dropped += int(len(good) - good.sum())
        if good.any():
            moving = good if (angles[good] != angles[good][0]).any() else np.flatnonzero(good)[:1]
            at, turns = timing.placed(frames[moving], quaternions(angles[moving]))
            if timing.whole:  # an interpolated quaternion is shorter than 1
                turns /= np.linalg.norm(turns, axis=1, keepdims=True)
            keys.turns[bone] = at, turns


def quaternions(angles: Float) -> Float:
    """Rotations of a head, a neck or an eye as quaternions.

    Args:
        angles: float64[n, 2 or 3], radians: yaw to the face's own left, pitch up, and roll towards
            its own left shoulder; the face looks along -y, z is up.

    Returns:
        float64[n, 4], w first; roll is applied first, then pitch, then yaw. Each quaternion has
        the sign that is nearest to its predecessor.
    """
    half = np.zeros((len(angles), 3))
    half[:, : angles.shape[1]] = angles / 2
    yaw = _about(2, half[:, 0])
    pitch = _about(0, -half[:, 1])
    roll = _about(1, half[:, 2])
    return near_signs(multiply(multiply(yaw, pitch), roll))


def angles_of(turns: Float) -> Float:
    """The inverse of `quaternions`: the angles of rotations of a head, a neck or an eye.

    Args:
        turns: float64[n, 4], unit quaternions, w first.

    Returns:
        float64[n, 3], yaw, pitch and roll in radians.
    """
    w, x, y, z = np.moveaxis(np.asarray(turns, np.float64), -1, 0)
    pitch = -np.arcsin(np.clip(2 * (w * x + y * z), -1.0, 1.0))
    yaw = np.arctan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z))
    roll = np.arctan2(-2 * (x * z - w * y), 1 - 2 * (x * x + y * y))
    return np.stack([yaw, pitch, roll], axis=-1)


def multiply(a: Float, b: Float) -> Float:
    """The product a * b: rotation b, followed by rotation a. float64[n or 1, 4], w first."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def near_signs(turns: Float) -> Float:
    """Quaternions float64[n, 4], each negated where that makes it nearer to its predecessor."""
    flips = np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    signs = np.concatenate([[1.0], np.cumprod(flips)]) if len(turns) else np.ones(0)
    return turns * signs[:, None]


def _about(axis: int, half: Float) -> Float:
    turn = np.zeros((len(half), 4))
    turn[:, 0], turn[:, axis + 1] = np.cos(half), np.sin(half)
    return turn
