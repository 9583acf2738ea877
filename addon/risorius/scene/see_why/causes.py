# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the causes of a vertex's motion, firing correctives, and the correctives of a control.

Motions are in millimetres. A corrective fires if its value is not 0. The index of a control counts
raw controls, correctives, network outputs and outputs of RBF poses, in this order (written
raw | corrective | network | pose).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base import parts, session
from ..base.blender_types import ArmatureObject
from . import displacement, present

Poses = tuple[NDArray[np.float32], NDArray[np.float32]]  # deltas [J, 9], weights [B]
_LEAST = 1e-3  # mm; smaller motions are float32 rounding of a head at 1.7 m height
_MOST_FIRING = 24  # correctives whose motion is computed: those with the largest values
# Session uid of a deforming armature -> causes of the last examined vertex.
_found: dict[int, Found] = session.table("causes.found", ("undo", "load"))
# Session uid of a deforming armature -> ((id of its Runtime, raw controls, LOD) of a pose, the
# strongest correctives of this pose).
_fired: dict[int, tuple[object, list[Cause]]] = session.table("causes.fired", ("undo", "load"))


@dataclass(frozen=True)
class Cause:
    """A control that moves a vertex.

    Attributes:
        control: index of the control, counted through raw controls, correctives, network outputs
            and pose outputs in this order.
        name: name of the control in lists.
        is_raw: whether the control is a raw control, which has a slider.
        value: current value.
        now: motion of the vertex in millimetres that the control currently causes.
        full: motion of the vertex in millimetres between rest and full value of the control, with
            all other controls unchanged; 0 if the control is no raw control.
        label: label of the control's slider; "" for none.
    """

    control: int
    name: str
    is_raw: bool
    value: float
    now: float
    full: float = 0.0
    label: str = ""


@dataclass(frozen=True)
class Found:
    """The causes of a vertex's motion.

    Attributes:
        mesh, vertex: index of the mesh in the DNA file, and of the vertex.
        moved: distance of the vertex from its neutral position in millimetres.
        causes: causes, the strongest first.
    """

    mesh: int
    vertex: int
    moved: float
    causes: list[Cause]


@dataclass(frozen=True)
class Part:
    """A corrective or RBF pose that has a given control as a factor or input.

    Attributes:
        control: index of the corrective or of the pose's output.
        name: its name in lists.
        value: its current value.
        others: (name, value) of its other factors or inputs.
    """

    control: int
    name: str
    value: float
    others: list[tuple[str, float]]


def of_vertex(rig: ArmatureObject, mesh: int, vertex: int) -> Found | None:
    """Find the causes of a vertex's motion in the current pose and store them for `last`.

    None if the character is baked, or its data or controls are lost.

    Args:
        rig: deforming armature.
        mesh: index of the mesh in the DNA file.
        vertex: vertex index.
    """
    now = present.of(rig)
    if now is None:
        return None
    live, raw = now.live, now.raw
    unit = displacement.millimetres(rig)
    count = len(raw)
    rows = np.tile(raw, (2 * count + 2, 1))
    each = np.arange(count)
    rows[each, each] = now.rests
    rows[count + each, each] = 1.0
    rows[-1] = now.rests
    batch = live.rig.evaluate_batch(rows, now.lod)
    places = displacement.at_vertex(live, mesh, vertex, batch.joints, batch.blend_shapes) * unit
    here = places[2 * count]
    added = np.linalg.norm(here - places[:count], axis=1)
    full = np.linalg.norm(places[count : 2 * count] - places[:count], axis=1)
    causes = [
        Cause(
            control=i,
            name=present.name_of(live, i),
            is_raw=True,
            value=float(raw[i]),
            now=float(added[i]),
            full=float(full[i]),
            label=live.labels[i],
        )
        for i in np.flatnonzero(np.maximum(added, full) > _LEAST).tolist()
    ]
    without = _without(now, firing(now))
    if without:
        poses = tuple(np.stack([w[i] for w in without.values()]) for i in (0, 1))
        apart = displacement.at_vertex(live, mesh, vertex, *poses) * unit - here
        values = live.rig.evaluate(raw, now.lod).controls
        for control, far in zip(without, np.linalg.norm(apart, axis=1).tolist(), strict=True):
            if far > _LEAST:
                name = present.name_of(live, control)
                causes.append(Cause(control, name, False, float(values[control]), far))
    causes.sort(key=lambda c: (-c.now, -c.full, c.control))
    moved = float(np.linalg.norm(here - places[-1]))
    found = _found[rig.session_uid] = Found(mesh, vertex, moved, causes)
    return found


def last(rig: ArmatureObject) -> Found | None:
    """The stored causes of the last examined vertex; None if no vertex was examined.

    Args:
        rig: deforming armature.
    """
    return _found.get(rig.session_uid)


def firing(now: present.Present) -> list[int]:
    """Indices of firing (not 0) correctives, network and pose outputs, largest magnitude first.

    Args:
        now: the face in its current pose.
    """
    values = np.asarray(now.live.rig.evaluate(now.raw, now.lod).controls)
    count = len(now.raw)
    on = np.flatnonzero(values[count:] != 0) + count
    return [int(i) for i in on[np.argsort(-np.abs(values[on]), kind="stable")]]


def _without(now: present.Present, controls: list[int]) -> dict[int, Poses]:
    """Index of a control -> the current pose without the effect of this control.

    Args:
        now: the face in its current pose.
        controls: indices in raw | corrective | network | pose of active controls.
    """
    live = now.live
    if not controls:
        return {}
    pose = live.rig.evaluate(now.raw, now.lod)
    names = present.names_of(live)
    given = native.part("explain.joints").contributions(live.dna, pose, now.lod, names)
    shapes = _shapes_by(now)
    out = {}
    for control in controls:
        joints, weights = pose.joints.copy(), pose.blend_shapes.copy()
        for joint, by in given.items():
            if control in by:
                joints[joint] -= by[control].astype(np.float32)
        weights[shapes.get(control, [])] = 0.0
        out[control] = (joints, weights)
    return out


def _shapes_by(now: present.Present) -> Mapping[int, list[int]]:
    """Index of a control -> blend shape channels that the control drives at the current LOD."""
    table = now.live.dna.blend_shape_channels
    count = int(table.lods[now.lod]) if now.lod < len(table.lods) else 0
    found: dict[int, list[int]] = {}
    pairs = zip(table.input_indices[:count], table.output_indices[:count], strict=True)
    for control, channel in pairs:
        found.setdefault(int(control), []).append(int(channel))
    return found


def without(now: present.Present, control: int) -> Poses:
    """Joint deltas and blend shape weights of the current pose without the effect of a corrective.

    Args:
        now: the face in its current pose.
        control: index of the corrective.
    """
    return _without(now, [control])[control]


def strongest(rig: ArmatureObject, count: int = 8) -> list[Cause]:
    """The firing correctives, sorted by the largest motion that each causes at any vertex.

    Only the correctives with the largest values are examined, at most _MOST_FIRING. `Cause.now` is
    the largest motion in millimetres.

    Args:
        rig: deforming armature.
        count: largest number of results.
    """
    now = present.of(rig)
    if now is None:
        return []
    key = (id(now.live), now.raw.tobytes(), now.lod)
    kept = _fired.get(rig.session_uid)
    if kept is None or kept[0] != key:
        kept = _fired[rig.session_uid] = (key, _strongest(rig, now))
    return kept[1][:count]


def is_known(rig: ArmatureObject) -> bool:
    """Whether the strongest correctives of the current pose are already computed.

    True too if the face has no current pose.

    Args:
        rig: deforming armature.
    """
    now, kept = present.of(rig), _fired.get(rig.session_uid)
    return now is None or (
        kept is not None and kept[0] == (id(now.live), now.raw.tobytes(), now.lod)
    )


def known(rig: ArmatureObject) -> list[Cause]:
    """The last computed strongest correctives, perhaps of an earlier pose; empty if there are none.

    Args:
        rig: deforming armature.
    """
    return list(_fired.get(rig.session_uid, (None, []))[1])


def _strongest(rig: ArmatureObject, now: present.Present) -> list[Cause]:
    live, unit = now.live, displacement.millimetres(rig)
    pose = live.rig.evaluate(now.raw, now.lod)
    meshes = displacement.meshes_at(rig, now.lod)
    at = {
        mesh: displacement.vertices(live, mesh, pose.joints, pose.blend_shapes) for mesh in meshes
    }
    out = []
    for control, poses in _without(now, firing(now)[:_MOST_FIRING]).items():
        far = [
            np.linalg.norm(displacement.vertices(live, m, *poses) - at[m], axis=1) for m in meshes
        ]
        most = max((float(f.max()) for f in far if len(f)), default=0.0) * unit
        name = present.name_of(live, control)
        out.append(Cause(control, name, False, float(pose.controls[control]), most))
    return sorted(out, key=lambda c: (-c.now, c.control))


def parts_of(rig: ArmatureObject, control: int) -> list[Part]:
    """The correctives and RBF poses that have a control as a factor or input, largest values first.

    Args:
        rig: deforming armature.
        control: index of the control, in raw | corrective | network | pose.
    """
    now = present.of(rig)
    if now is None:
        return []
    values = now.live.rig.evaluate(now.raw, now.lod).controls
    found = [
        Part(
            corrective,
            present.name_of(now.live, corrective),
            float(values[corrective]),
            [(present.name_of(now.live, c), float(values[c])) for c in factors if c != control],
        )
        for corrective, factors in present.factors_of(now.live).items()
        if control in factors
    ]
    return sorted(found, key=lambda part: (-abs(part.value), len(part.others), part.control))


def sliders_of(rig: ArmatureObject, control: int) -> list[str]:
    """The labels of the raw controls on which a control depends, directly or through its factors.

    A raw control depends only on itself.

    Args:
        rig: deforming armature.
        control: index in raw | corrective | network | pose.
    """
    now = present.of(rig)
    if now is None:
        return []
    factors, labels = present.factors_of(now.live), now.live.labels
    waiting, seen = [control], set[int]()
    while waiting:
        one = waiting.pop()
        if one not in seen:
            seen.add(one)
            waiting.extend(factors.get(one, ()))
    return [labels[i] for i in sorted(seen) if i < len(labels)]


def control_of(rig: ArmatureObject, label: str) -> int:
    """The index of a raw control by its label; -1 if the face has no such control.

    Args:
        rig: deforming armature.
        label: name of the slider.
    """
    now = present.of(rig)
    return now.live.labels.index(label) if now is not None and label in now.live.labels else -1


def nearest(rig: ArmatureObject, item: int, place: NDArray[np.float64]) -> int:
    """The vertex of a mesh nearest to a position in the current pose; -1 if there is no pose.

    Args:
        rig: deforming armature.
        item: index of the mesh in the DNA file.
        place: float64[3] in the space of the rig, Blender units.
    """
    now = present.of(rig)
    if now is None:
        return -1
    pose = now.pose()
    points = displacement.vertices(now.live, item, pose.joints, pose.blend_shapes)
    return int(np.argmin(np.linalg.norm(points - place, axis=1)))


def mesh_of(item: object) -> int:
    """The index in the DNA file of a mesh object of a character, -1 for any other object."""
    get = getattr(item, "get", None)
    return int(get(parts.MESH, -1)) if get is not None else -1
