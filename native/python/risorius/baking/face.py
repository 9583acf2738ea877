# SPDX-License-Identifier: MIT
"""Loads a character for baking, adapts clips to it, and evaluates their frames in chunks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

import risorius
from risorius.base.errors import ArgumentError
from risorius.controls.control_names import ControlNames
from risorius.rigs.joint_controls import (
    ANGLES,
    JointControl,
    bone_turns,
    joint_controls,
    shared,
    turned_joints,
)

Floats = npt.NDArray[np.float32]
PARTS = ("joints", "shapes", "maps", "controls")
FIELDS = {
    "joints": "joints",
    "shapes": "blend_shapes",
    "maps": "animated_maps",
    "controls": "controls",
}
"""The users' names for parts of a Pose -> its fields."""
_LAYERS = ("behavior", "machine_learned_behavior", "rbf_behavior", "twist_swing_behavior")
# Bytes of poses per chunk. A chunk fits into the processor's cache, where work is several times
# faster.
_CHUNK_BYTES = 8 << 20


@dataclass(frozen=True)
class Face:
    """A compiled character, and unique names of its joints, blend shapes, animated maps
    and controls."""

    name: str
    rig: risorius.Rig
    names: dict[str, list[str]]
    """Part -> a unique name for each of its joints, channels, maps or controls."""
    translation_unit: str
    rotation_unit: str
    psd_range: tuple[int, int]
    """Index range of the correctives among the controls: first, end (exclusive)."""
    turning: tuple[JointControl, ...] = ()
    """Joints whose rotation is set by raw controls."""
    shares: Mapping[int, tuple[str, float]] = field(default_factory=dict)
    """Joint -> (bone, share): joints that rotate with the neck or head, see turned_joints."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Short names of a joint's components: translation (tx, ty, tz), rotation and scale."""
        turn = ("qx", "qy", "qz", "qw") if self.rig.rotation == "quaternion" else ("rx", "ry", "rz")
        return ("tx", "ty", "tz", *turn, "sx", "sy", "sz")

    def rest(self, part: str) -> Floats:
        """The rest values of a part of the pose: "joints", "shapes", "maps" or "controls".

        The part "joints" has float32[joints, columns], the differences from the neutral pose: 0 in
        all columns except qw, which has 1. Any other part has float32[n], one value per name.
        """
        if part == "joints":
            joint = np.array([name == "qw" for name in self.columns], np.float32)
            return np.tile(joint, (self.rig.joint_count, 1))
        rest = np.zeros(len(self.names[part]), np.float32)
        if part == "controls":
            raw = self.rig.initial_raw_controls
            rest[: len(raw)] = raw
        return rest

    def check_lod(self, lod: int) -> None:
        """Check that the character has a LOD. Raises: ValueError: it lacks the LOD."""
        last = max(1, self.rig.lod_count) - 1
        if not 0 <= lod <= last:
            raise ArgumentError(f"{self.name}: a LOD from 0 to {last} was expected, found {lod}")


def load_face(path: Path, *, quaternions: bool = False) -> Face:
    """Compile the character of a DNA file, or load it from the user's cache of compiled faces.

    Args:
        path: path of the DNA file.
        quaternions: True: rotations of joints are quaternions (x, y, z, w); False: Euler angles in
            the file's unit.

    Raises:
        DnaError: not a valid DNA file.
    """
    rig = risorius.compile_cached(path, rotation="quaternion" if quaternions else "euler")
    dna = risorius.load(path, layers=_LAYERS)
    controls = ControlNames(dna)
    names = {
        "joints": _each_once(dna.joint_names, rig.joint_count, "joint"),
        "shapes": _each_once(dna.blend_shape_channel_names, rig.blend_shape_count, "channel"),
        "maps": _each_once(dna.animated_map_names, rig.animated_map_count, "map"),
        "controls": _each_once(controls.names, rig.control_count, "control"),
    }
    psds = (controls.psd_begin, controls.psd_end)
    turning = tuple(joint_controls(dna)[0])
    return Face(
        path.stem, rig, names, dna.translation_unit, dna.rotation_unit, psds, turning,
        turned_joints(dna.joint_names),
    )  # fmt: skip


def _each_once(names: list[str], count: int, kind: str) -> list[str]:
    """A unique name for each element of a kind.

    An element without a name is called by its kind and index, e.g. "joint 3". If an earlier element
    has the same name, the index is added to the later element's name, e.g. "jaw#3".
    """
    out: list[str] = []
    seen: set[str] = set()
    for index in range(count):
        name = (names[index] if index < len(names) else "") or f"{kind} {index}"
        name = f"{name}#{index}" if name in seen else name
        seen.add(name)
        out.append(name)
    return out


def prepared(
    clip: risorius.Clip,
    face: Face,
    rate: float | None = None,
    frames: tuple[int | None, int | None] = (None, None),
) -> risorius.Clip:
    """Resample and cut a clip, and convert its neck and head curves for a face.

    Args:
        clip: any clip.
        face: the character whose neck and head joints receive the rotations.
        rate: resample to this number of frames per second; None: do not resample.
        frames: first and end (exclusive), counted from 0 after resampling; frames beyond the clip's
            end are ignored.

    Raises:
        ValueError: no frame remains.
        BudgetError: `rate` gives more frames than a clip of this size may have.
    """
    found = clip.frame_count
    if rate is not None:
        clip = clip.resampled(rate)
    part = slice(*frames)
    if part != slice(None):
        times = clip.frame_times()[part]
        clip = clip.replaced(
            curves=clip.curves[:, part],
            times=None if clip.times is None else times,
            start=float(times[0]) if times.size else clip.start,
        )
    if not clip.frame_count:
        raise ArgumentError(
            f"a clip with frames was expected, found {found} frames, of which 0 were requested"
        )
    return with_head_turns(clip, face)


def with_head_turns(clip: risorius.Clip, face: Face) -> risorius.Clip:
    """Add curves of the raw controls that rotate the neck and head joints of a face.

    The rotations are computed from the clip's curves of angles, such as head.yaw: yaw, pitch and
    roll of neck and head in radians. Neck joints get no curves if the clip has no neck angles, and
    head joints get none if it has no head angles. A joint also gets no curves if the clip already
    has a curve of one of the joint's raw controls.

    Args:
        clip: a clip with or without curves of these angles.
        face: the character.

    Returns:
        The clip with additional curves: one per quaternion component of each rotated joint.
    """
    raw = face.rig.raw_control_names
    given = dict(zip(clip.names, clip.curves, strict=True))
    names, curves = list[str](), list[Floats]()
    for item in face.turning:
        bone, share = face.shares.get(item.joint, ("", 0.0))
        own = [raw[control] for control in item.controls]
        turn = bone_turns(bone, given)
        if turn is not None and not any(name in clip for name in own):
            names += own
            curves += list(item.values(shared(turn, share)).T.astype(np.float32))
    if not names:
        return clip
    return clip.replaced(names=[*clip.names, *names], curves=np.array([*clip.curves, *curves]))


class Chunk(NamedTuple):
    """Poses of consecutive frames."""

    first: int
    pose: risorius.Pose
    """Each field has a leading [frames]."""


def missing(clip: risorius.Clip, face: Face) -> list[str]:
    """The names of curves of `clip` that have no effect on `face`. A curve has an effect if it is a
    raw control of the face, or an angle of the neck or of the head, such as head.yaw, for which raw
    controls of the face rotate joints."""
    have = set(face.rig.raw_control_names)
    bones = {face.shares.get(item.joint, ("", 0.0))[0] for item in face.turning}
    have.update(name for bone in bones for name in ANGLES.get(bone, ()))
    return [name for name in clip.names if name not in have]


def played(clip: risorius.Clip, face: Face, lod: int, threads: int = 1) -> Iterator[Chunk]:
    """The poses of all frames, in chunks whose size depends on the character and `threads`.

    Controls without a curve have their rest value. Each frame equals Rig.evaluate of its controls,
    bit for bit.

    Args:
        clip: curves of raw controls; unknown ones are ignored.
        face: from `load_face`.
        lod: from 0, below the character's number of LODs.
        threads: number of threads; the size of a chunk is multiplied by it.
    """
    place = {name: i for i, name in enumerate(face.rig.raw_control_names)}
    rows = [i for i, name in enumerate(clip.names) if name in place]
    columns = [place[clip.names[i]] for i in rows]
    rest = face.rig.initial_raw_controls
    size = chunk_frames(face) * max(1, threads)
    raw = np.tile(rest, (min(size, clip.frame_count), 1))
    for first in range(0, clip.frame_count, size):
        count = min(size, clip.frame_count - first)
        raw[:count, columns] = clip.curves[rows, first : first + count].T
        yield Chunk(first, face.rig.evaluate_batch(raw[:count], lod=lod, threads=threads))


def chunk_frames(face: Face) -> int:
    """Number of frames that one thread evaluates at a time."""
    numbers = face.rig.joint_count * len(face.columns) + face.rig.control_count
    numbers += face.rig.blend_shape_count + face.rig.animated_map_count
    return int(np.clip(_CHUNK_BYTES // (4 * max(1, numbers)), 16, 1024))
