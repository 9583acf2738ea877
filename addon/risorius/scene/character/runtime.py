# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles the DNA of characters, and caches the result by the hash of the DNA's content.

The cache holds no Blender object, so it stays valid after load, undo and append. In this file, look
controls are the raw controls that rotate an eye, such as eyeLookUpL.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ... import native
from ...logic.base import names
from ...logic.base.sentences import told
from ...logic.base.space import Space, SpaceError, world_matrices, yaw_pitch
from ...logic.character import board_layout, board_table, plans, primary_table
from ..base import console, last_written, parts, saved, session, storage
from ..base.blender_types import ArmatureObject, MeshObject

# The bones of the control armature that do not belong to the face board.
CONTROL_BONES = (parts.FACE, "neck", "head", "eyes", "eye_L", "eye_R")
BOARD_BONES = ("board", "board_frames")  # the bone that moves the board; the bone with its lines
COMPLETE, PRIMARY = "COMPLETE", "PRIMARY"  # the two kinds of board
DEFAULT_EYE_ANGLE = float(np.radians(30.0))  # radians, for eyes that look controls do not turn


@dataclass
class Runtime:
    """Compiled data of one DNA at one unit scale.

    Attributes:
        dna: the parsed file.
        rig: its compiled risorius.Rig.
        space: conversion from the DNA's axes and unit to Blender's.
        labels: property names of the raw controls by index.
        rests: rest values of the raw controls.
        lowest: lowest values of the raw controls; components of rotations go below 0.
        owned: indices of the joints that the evaluator writes.
        rest: float64[J, 4, 4], world matrices of the neutral joints in Blender's units.
        anchors: joints of neck, head and eyes.
        look: side "L" or "R" -> for each look control of this eye: (index of the raw control, yaw
            and pitch of the eye in radians at value 1).
        lids: name such as eyeBlinkL or eyeWidenR -> index of the raw control.
        turning: joints whose rotation is stored in raw controls.
        morphs: cache, mesh index -> risorius.Morph.
        surfaces: cache, level of detail -> risorius.Surface.
        chains: cache, joint index -> Chain.
        board: kind of the face board of `table` and `handles`: PRIMARY or COMPLETE.
    """

    dna: native.Dna
    rig: native.Rig
    space: Space
    labels: list[str]
    rests: list[float]
    lowest: list[float]
    owned: frozenset[int]
    rest: NDArray[np.float64]
    anchors: plans.Anchors
    look: dict[str, list[tuple[int, float, float]]]
    lids: dict[str, int]
    turning: list[Turning]
    morphs: dict[int, native.Morph] = field(default_factory=dict)
    surfaces: dict[int, native.Surface] = field(default_factory=dict)
    chains: dict[int, Chain] = field(default_factory=dict)
    board: str = COMPLETE

    @cached_property
    def mesh_count(self) -> int:
        """Number of meshes; cached, because each access to `dna.meshes` makes new objects."""
        return len(self.dna.meshes)

    def vertex_count(self, mesh_index: int) -> int:
        """Number of vertices of a mesh of the DNA file."""
        return self.morph(mesh_index).vertex_count

    def chain(self, joint: int) -> Chain:
        """The chain of joints from the root to a joint; computed at the first call."""
        if joint not in self.chains:
            self.chains[joint] = _chain(self.dna, self.space, joint)
        return self.chains[joint]

    def morph(self, mesh_index: int) -> native.Morph:
        """The compiled blend shapes of a mesh; compiled at the first call."""
        if mesh_index not in self.morphs:
            self.morphs[mesh_index] = native.module().Morph(
                self.dna, mesh_index, matrix=self.space.delta_matrix
            )
        return self.morphs[mesh_index]

    def surface(self, lod: int) -> native.Surface:
        """The evaluator of all meshes of a level of detail; compiled at the first call."""
        if lod not in self.surfaces:
            self.surfaces[lod] = native.module().Surface(self.dna, self.rig, lod=lod)
        return self.surfaces[lod]

    @cached_property
    def _with_primary(self) -> Runtime:
        return replace(self, board=PRIMARY)

    def with_board(self, kind: str) -> Runtime:
        """This Runtime, or its copy for the primary board.

        Args:
            kind: PRIMARY or COMPLETE.
        """
        assert self.board == COMPLETE or kind == PRIMARY
        return self._with_primary if kind != self.board else self

    @cached_property
    def table(self) -> board_table.BoardTable:
        """The table that converts GUI controls to raw controls: the table of the primary board, the
        table of the file, or one GUI control per raw control if the file has no table."""
        if self.board == PRIMARY:
            return primary_table.table_of(self.labels)
        if not self.dna.gui_control_names:
            return board_table.of_raw_controls(self.labels, self.lowest)
        rows = self.dna.gui_to_raw
        lines = (rows.from_values, rows.to_values, rows.slope_values, rows.cut_values)
        columns = np.stack([rows.input_indices, rows.output_indices, *lines])
        return board_table.of_file(self.dna.gui_control_names, columns, len(self.labels))

    @cached_property
    def handles(self) -> list[board_layout.Handle]:
        """The handles of the face board. Only the handles of a primary board have positions."""
        taken = (*CONTROL_BONES, *BOARD_BONES)
        if self.board == PRIMARY:
            return primary_table.handles_of(self.table, {}, taken)
        ways = [board_layout.UP] * len(self.table.names)
        region_of = native.regions().of_slider
        return board_layout.handles_of(self.table, ways, region_of, taken)

    def bone_space(self, joints: Sequence[int]) -> native.BoneSpace:
        """The native converter from deltas of given joints to transforms of their pose bones."""
        space = self.space
        return native.module().BoneSpace(
            self.dna.neutral_joint_rotations,
            joints,
            axes=space.axes,
            scale=space.scale,
            radians=space.radians,
            sequence=space.sequence,
            signs=space.signs,
        )


@dataclass(frozen=True)
class Turning:
    """A joint whose rotation is stored in four raw controls.

    Attributes:
        joint: index of the joint.
        controls: indices of the raw controls of x, y, z and w.
        bone: the control bone that rotates the joint, "neck" or "head"; "": none.
        share: fraction of the control bone's rotation that the joint gets, 0 to 1.
        armature_axes: matrix that converts the vector part of a quaternion from the armature's
            axes to the joint's axes in the file.
        bone_axes: matrix that converts the vector part of a quaternion from the axes of the joint's
            bone to the joint's axes in the file.
    """

    joint: int
    controls: tuple[int, int, int, int]
    bone: str
    share: float
    armature_axes: Matrix
    bone_axes: Matrix


@dataclass
class Chain:
    """The joints from the root to a joint.

    Attributes:
        joints: int64[n], indices of the joints, root first.
        angles: float64[n, 3], neutral Euler angles relative to the parent, in the file's units.
        offsets: float64[n, 3], neutral translations relative to the parent, in Blender's units
            and axes.
    """

    joints: NDArray[np.int64]
    angles: NDArray[np.float64]
    offsets: NDArray[np.float64]


def _chain(dna: native.Dna, space: Space, joint: int) -> Chain:
    parents, found = dna.joint_parents, [joint]
    while int(parents[found[-1]]) != found[-1]:
        found.append(int(parents[found[-1]]))
    joints = np.array(found[::-1], np.int64)
    angles = np.asarray(dna.neutral_joint_rotations, np.float64)[joints]
    return Chain(joints, angles, space.points(dna.neutral_joint_translations[joints]))


_cache: dict[tuple[str, float], Runtime | None] = session.table("runtime.cache", ("unregister",))
_LEAST_UNIT, _MOST_UNIT = 1e-9, 1e9  # range of metres per Blender unit


def of(rig: ArmatureObject, board: str | None = None) -> Runtime | None:
    """The Runtime of a character.

    Args:
        rig: the deforming armature.
        board: PRIMARY or COMPLETE; None: the kind of the character's board.

    Returns:
        The Runtime; None if the DNA of the armature is missing or cannot be read.
    """
    text = rig.get(parts.DNA)
    digest = storage.content_hash(text)
    if not digest:
        return None
    key = (digest, unit_of(rig))
    if key not in _cache:
        try:
            _cache[key] = _compile(storage.content(text), key[1])
        except (native.dna_error(), SpaceError, ValueError, LookupError) as error:
            # Cache the failure, so that the error is printed once and not at every frame.
            words = names.printable(str(error)).rstrip(".")
            console.say(f"the data of {rig.name} cannot be read: {words}.")
            _cache[key] = None
    live = _cache[key]
    if board is None:
        controls = saved.item(rig, parts.CONTROLS)
        is_primary = controls is not None and controls.get(parts.BOARD_KIND) == PRIMARY
        board = PRIMARY if is_primary else COMPLETE
    return live.with_board(board) if live is not None else None


def there(rig: ArmatureObject, board: str | None = None) -> Runtime:
    """The Runtime of a character; the caller must have checked that `of` gives one.

    Args:
        rig: the deforming armature.
        board: PRIMARY or COMPLETE; None: the kind of the character's board.
    """
    live = of(rig, board)
    assert live is not None
    return live


def take(armature: ArmatureObject, dna: native.Dna, rig: native.Rig) -> None:
    """Cache the compiled data of an import, so that the same bytes are not compiled again.

    Args:
        armature: the deforming armature, with its properties DNA and UNIT.
        dna: Dna parsed from the bytes in the armature's Text.
        rig: risorius.Rig compiled from the Dna.

    Raises:
        PlanError: the file cannot be evaluated.
    """
    key = (storage.content_hash(armature.get(parts.DNA)), unit_of(armature))
    if _cache.get(key) is None:
        try:
            _cache[key] = _runtime(dna, rig, key[1])
        except (native.dna_error(), SpaceError, ValueError, LookupError) as error:
            raise plans.PlanError(told("The file cannot be evaluated.")) from error


def mesh_number(live: Runtime, item: MeshObject) -> int | None:
    """The index of the DNA mesh that an object shows, or None if the file has no such mesh.

    Args:
        live: the Runtime of the character.
        item: a mesh object of the character.
    """
    number = saved.whole(item, parts.MESH, -1)
    return number if 0 <= number < live.mesh_count else None


def dna_mesh(live: Runtime, item: MeshObject) -> native.Mesh | None:
    """The DNA mesh that an object shows, or None if the file has no such mesh.

    Args:
        live: the Runtime of the character.
        item: a mesh object of the character.
    """
    number = mesh_number(live, item)
    return None if number is None else live.dna.meshes[number]


def unit_of(rig: ArmatureObject) -> float:
    """Metres per Blender unit at import."""
    return saved.number(rig, parts.UNIT, 1.0, _LEAST_UNIT, _MOST_UNIT)


def forget_unused(rigs: Iterable[ArmatureObject]) -> None:
    """Drop compiled data of deleted characters, and forget the last written values of all.

    Args:
        rigs: deforming armatures that exist.
    """
    used = {storage.content_hash(rig.get(parts.DNA)) for rig in rigs}
    for key in [k for k in _cache if k[0] not in used]:
        del _cache[key]
    last_written.forget()


def compiled(content: bytes) -> Runtime:
    """Compile a DNA file that belongs to no character, with 1 metre per Blender unit.

    Args:
        content: bytes of the file.

    Raises:
        DnaError, SpaceError, ValueError: the file cannot be compiled.
    """
    return _compile(content, 1.0)


def _compile(content: bytes, unit: float) -> Runtime:
    risorius = native.module()
    dna = risorius.load(content)
    return _runtime(dna, risorius.Rig(dna), unit)


def _runtime(dna: native.Dna, rig: native.Rig, unit: float) -> Runtime:
    space = plans.space_of(dna, unit)
    anchors = plans.find_anchors(dna.joint_names)
    owned = {int(j) for j in rig.joint_indices_written} | set(anchors.neck)
    if anchors.head is not None:
        owned.add(anchors.head)
    rest = world_matrices(
        space.rotations(dna.neutral_joint_rotations),
        space.points(dna.neutral_joint_translations),
        np.asarray(dna.joint_parents),
    )
    sliders = plans.plan_controls(dna.raw_control_names, rig.initial_raw_controls)
    runtime = Runtime(
        dna=dna,
        rig=rig,
        space=space,
        labels=[slider.label for slider in sliders],
        rests=[slider.rest for slider in sliders],
        lowest=[slider.lowest for slider in sliders],
        owned=frozenset(owned),
        rest=rest,
        anchors=anchors,
        look={},
        lids={},
        turning=_turning(dna, space, anchors),
    )
    runtime.look = _measure_look(runtime)
    lids = {f"{kind}{side}" for kind in ("eyeBlink", "eyeWiden") for side in "LR"}
    short = [name.rsplit(".", 1)[-1] for name in dna.raw_control_names]
    runtime.lids = {name: i for i, name in enumerate(short) if name in lids}
    return runtime


def _turning(dna: native.Dna, space: Space, anchors: plans.Anchors) -> list[Turning]:
    sign = 1.0 if np.linalg.det(space.axes) > 0.0 else -1.0
    bone_axes = Matrix((sign * space.axes.T).tolist())
    shares = {joint: ("neck", 1.0 / len(anchors.neck)) for joint in anchors.neck}
    if anchors.head is not None:
        shares[anchors.head] = ("head", 1.0)
    found, _sentences = native.part("rigs.joint_controls").joint_controls(dna)
    return [
        Turning(
            item.joint,
            item.controls,
            *shares.get(item.joint, ("", 0.0)),
            Matrix(item.axes.tolist()),
            bone_axes,
        )
        for item in found
    ]


def _measure_look(runtime: Runtime) -> dict[str, list[tuple[int, float, float]]]:
    """Side "L" or "R" -> (look control, yaw, pitch) of the eye in radians at control value 1."""
    found = {}
    where = {name.rsplit(".", 1)[-1]: i for i, name in enumerate(runtime.dna.raw_control_names)}
    for side in "LR":
        turns = []
        for direction, yaw, pitch in (
            ("Left", 1.0, 0.0),
            ("Right", -1.0, 0.0),
            ("Up", 0.0, 1.0),
            ("Down", 0.0, -1.0),
        ):
            control = where.get(f"eyeLook{direction}{side}")
            if control is not None:
                angle = _response(runtime, control, side, bool(yaw))
                turns.append((control, yaw * angle, pitch * angle))
        found[side] = turns
    return found


def _response(runtime: Runtime, control: int, side: str, horizontal: bool) -> float:
    """The rotation of an eye by a look control at value 1, in radians.

    DEFAULT_EYE_ANGLE is returned if the eye rotates by less than 2 degrees or has no joint.

    Args:
        runtime: the Runtime of the character.
        control: index of the look control.
        side: "L" or "R".
        horizontal: True: yaw; False: pitch.
    """
    joint = runtime.anchors.eyes.get(side)
    if joint is None:
        return DEFAULT_EYE_ANGLE
    raw = np.array(runtime.rests, np.float32)
    raw[control] = 1.0
    delta = runtime.rig.evaluate(raw).joints[joint, 3:6]
    neutral = np.asarray(runtime.dna.neutral_joint_rotations, np.float64)[joint]
    before, after = runtime.space.rotations(np.stack([neutral, neutral + delta]))
    parent = runtime.rest[joint][:3, :3] @ before.T
    turned = parent @ after @ before.T @ parent.T @ np.array([0.0, -1.0, 0.0])
    yaw, pitch = yaw_pitch(turned)
    angle = abs(yaw if horizontal else pitch)
    return angle if angle > np.radians(2.0) else DEFAULT_EYE_ANGLE
