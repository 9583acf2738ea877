# SPDX-License-Identifier: MIT
"""Reads the skin of a DNA file and its displacements by each control and each corrective."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..._native import Dna, Probe, Rig
from ...author.geometry import skeleton as sk
from ...author.geometry.rigid import about
from ...author.geometry.simplify import fan_triangles
from ...author.geometry.skeleton import Doubles, Ints
from ...author.heads.turning import jaw_turn
from ...base.budget import Budget
from ...base.errors import ArgumentError
from ...gameface.parts import axes_of
from ...solving.surface import Surface as Posed
from ...web.kinds import kind_of
from ..errors import Stopped
from ..surface import Surface

Floats = npt.NDArray[np.float32]
Progress = Callable[[float], bool | None]
Pose = tuple[str, ...]  # controls that are 1, in the file's order
JAW = "FACIAL_C_Jaw"
_MOVES = 1e-3  # cm: a control whose largest motion is smaller does not move the skin


@dataclass(frozen=True)
class Jaw:
    """The jaw of a face as one rigid body.

    Attributes:
        hinge: float64[3], the centre of rotation.
        turns: by pose, the jaw's motion from the rest pose: rotation about the hinge float64[3, 3],
            then translation float64[3]; poses that do not move the jaw are left out.
    """

    hinge: Doubles
    turns: dict[Pose, tuple[Doubles, Doubles]] = field(default_factory=dict)


@dataclass(frozen=True)
class TemplateFace:
    """The skin of a face in cm, y up, the face towards +z.

    Attributes:
        name: name of the face.
        surface: the skin in the rest pose.
        mesh: index of the skin mesh in the file.
        controls: names of all raw controls without the prefix before the last dot.
        ways: float32[V, 3] by pose, displacements of the skin by one control, or by all controls
            of a corrective together. Poses that do not move the skin are left out.
        jaw: the jaw; None if no control turns it.
    """

    name: str
    surface: Surface
    mesh: int
    controls: tuple[str, ...]
    ways: dict[Pose, Floats]
    jaw: Jaw | None


def read_template(dna: Dna, progress: Progress | None = None) -> TemplateFace:
    """Read the skin of a face at LOD 0.

    Args:
        dna: a face with geometry and controls.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        ArgumentError: the face has no skin mesh at LOD 0, or no control moves it.
        BudgetError: vertices times poses need too much memory for the size of the file.
        DnaError: the file cannot be evaluated.
        Stopped: `progress` returned False.
    """
    rig = Rig(dna)
    posed = Posed(dna, rig, 0)
    axes = 100.0 * axes_of(dna)
    names = tuple(name.rpartition(".")[2] for name in dna.raw_control_names)
    rest = np.asarray(rig.initial_raw_controls, np.float32)
    mesh = _skin(dna, posed)
    count = len(dna.meshes[mesh].positions)
    sets = _poses(dna)
    Budget.of(dna.size_in_bytes()).hold(
        12.0 * count * len(sets), f"{count:,} vertices in {len(sets):,} poses"
    )
    probe = _probe(posed, mesh, count)
    points = probe.positions(rest).astype(np.float64)
    ways: dict[Pose, Floats] = {}
    for number, controls in enumerate(sets):
        raw = rest.copy()
        raw[list(controls)] = 1.0
        moved = probe.positions(raw).astype(np.float64) - points
        if np.isfinite(moved).all() and np.abs(moved @ axes.T).max(initial=0.0) > _MOVES:
            ways[tuple(names[c] for c in controls)] = (moved @ axes.T).astype(np.float32)
        if number % 16 == 0 and progress is not None and progress(number / len(sets)) is False:
            raise Stopped
    if not ways:
        raise ArgumentError(f"{dna.name or 'the template'}: controls that move the skin were "
                            "expected, found none")  # fmt: skip
    triangles = _triangles(dna, mesh)
    surface = Surface(points @ axes.T, triangles[:, ::-1] if np.linalg.det(axes) < 0 else triangles)
    return TemplateFace(
        dna.name, surface, mesh, names, ways, _jaw(dna, sets, names, axes, surface.points, ways)
    )


def left_over(ways: Mapping[Pose, Doubles | Floats]) -> dict[Pose, Doubles]:
    """float64[V, 3] by pose: the displacements of each corrective, without the displacements of its
    single controls and of smaller correctives of the same controls.

    Args:
        ways: [V, 3] by pose, the displacements with all controls of the pose at 1, as in the
            attribute `ways` of TemplateFace.
    """
    out: dict[Pose, Doubles] = {}
    for pose in sorted((p for p in ways if len(p) > 1), key=len):
        rest = ways[pose].astype(np.float64)
        for control in pose:
            if (control,) in ways:
                rest = rest - ways[(control,)]
        for smaller, part in out.items():
            if set(smaller) < set(pose):
                rest = rest - part
        out[pose] = rest
    return out


def _poses(dna: Dna) -> list[tuple[int, ...]]:
    """Indices of the raw controls with value 1 in each pose: each control alone, then the controls
    of each corrective."""
    count = len(dna.raw_control_names)
    sets = [tuple(sorted(parts)) for parts in sk.psd_parts(dna).values()]
    together = dict.fromkeys(s for s in sets if len(s) > 1 and s[-1] < count)
    return [*((c,) for c in range(count)), *together]


def _skin(dna: Dna, posed: Posed) -> int:
    """The index of the skin mesh of LOD 0; the mesh with the most vertices if there are several."""
    known = [m for m in posed.mesh_indices if len(dna.meshes[m].positions)]
    skin = [m for m in known if kind_of(dna.mesh_names[m]) == "skin"]
    if not skin:
        raise ArgumentError(f"{dna.name or 'the template'}: a mesh of skin was expected at LOD 0, "
                            f"found {len(known)} of other kinds")  # fmt: skip
    return max(skin, key=lambda m: len(dna.meshes[m].positions))


def _probe(posed: Posed, mesh: int, count: int) -> Probe:
    return posed.probe(np.stack([np.full(count, mesh), np.arange(count)], axis=1).astype(np.int64))


def _triangles(dna: Dna, mesh: int) -> Ints:
    source = dna.meshes[mesh]
    return source.layout_positions.astype(np.int64)[fan_triangles(source)]


def _jaw(
    dna: Dna,
    sets: Iterable[tuple[int, ...]],
    names: tuple[str, ...],
    axes: Doubles,
    points: Doubles,
    ways: dict[Pose, Floats],
) -> Jaw | None:
    """The jaw from the motion of the jaw joint, or from the displacements of jawOpen if no joint
    moves."""
    if JAW in dna.joint_names:
        found = _jaw_of_joint(dna, sets, names, axes)
        if found.turns:
            return found
    opening = ways.get(("jawOpen",))
    if opening is None:
        return None
    shapes = {pose[0]: way.astype(np.float64) for pose, way in ways.items() if len(pose) == 1}
    turn = jaw_turn(points, shapes, {n: [n] for n in shapes}, shapes["jawOpen"], [])
    if turn is None:
        return None
    turns: dict[Pose, tuple[Doubles, Doubles]] = {
        (name,): motion for name, motion in turn.motions.items()
    }
    for pose in ways:
        moving = [c for c in pose if (c,) in turns]
        if len(pose) > 1 and moving:
            turns[pose] = turns[(moving[0],)]
    return Jaw(turn.position, turns)


def _jaw_of_joint(
    dna: Dna, sets: Iterable[tuple[int, ...]], names: tuple[str, ...], axes: Doubles
) -> Jaw:
    columns = sk.column_count(dna)
    deltas = sk.column_deltas(dna, columns)
    rest = sk.world_matrices(dna, np.zeros_like(deltas[0]))
    joint, together = dna.joint_names.index(JAW), sk.psd_parts(dna)
    hinge, turns = rest[joint, :3, 3], {}
    for controls in sets:
        active = [*controls, *(c for c, parts in together.items() if parts <= set(controls))]
        change = deltas[[c for c in active if c < columns]].sum(axis=0)
        if not change.any():
            continue
        motion = sk.world_matrices(dna, change)[joint] @ np.linalg.inv(rest[joint])
        rotation, shift = about(hinge, motion[:3, :3], motion[:3, 3])
        if np.abs(motion[:3] - np.eye(3, 4)).max() < 1e-6:
            continue
        into = axes @ rotation @ np.linalg.inv(axes)
        turns[tuple(names[c] for c in controls)] = into, axes @ shift
    return Jaw(axes @ hinge, turns)
