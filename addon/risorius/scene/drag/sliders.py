# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts between sliders and the raw controls of the drag solver.

The raw controls include the animation layers; the sliders do not.
Either the sliders or the face board lead, that is, move the face. A leading board replaces only the
sliders that its handles can move.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ... import native
from ..animation import layer_mixing, layers
from ..base import parts
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import board, runtime, sides
from ..frame import inputs

Float = NDArray[np.float64]

_TRIED = 1.0 / 64  # test change of a slider, to measure the gain through its layers
_LEAST = 1e-3  # smallest gain of a slider that can be dragged


@dataclass
class Sliders:
    """Sliders and their visible effect at the start of a drag.

    Attributes:
        before: property name -> value to restore.
        start: float64[R], values of the sliders; if the face board leads, the values that the
            board gives them.
        seen: float32[R], the raw controls of the face, with layers and eye bones.
        gain: float64[R], change of a raw control divided by the change of its slider; 1 if this
            is too small for a drag.
        free: bool[R], sliders that the drag may move.
        low, high: float64[R], the limits of `seen`.
        linked: for each slider that a driver links to the other side: (index of the slider that
            leads, index of the slider that follows).
        places: bone -> location of each handle of a leading face board; empty if sliders lead.
    """

    before: dict[str, float]
    start: Float
    seen: NDArray[np.float32]
    gain: Float
    free: NDArray[np.bool_]
    low: Float
    high: Float
    linked: list[tuple[int, int]]
    places: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def values(self, raw: NDArray[np.float32]) -> Float:
        """float64[R]: the slider values that give wanted raw controls.

        Args:
            raw: float32[R], the wanted raw controls.
        """
        change = raw.astype(np.float64) - self.seen
        moved = self.free & (np.abs(change) > 1e-7)
        values = np.where(moved, self.start + change / self.gain, self.start)
        for leader, follower in self.linked:
            if moved[leader] or moved[follower]:
                values[leader] = (values[leader] + values[follower]) / 2
        return values


def read(rig: ArmatureObject, live: runtime.Runtime, depsgraph: Depsgraph) -> Sliders:
    """Read the sliders of a face and their effect on the raw controls.

    Args:
        rig: the deforming armature.
        live: Runtime of the character.
        depsgraph: graph in which the controls were evaluated.
    """
    controls = parts.controls_there(rig)
    bone, seen = controls.pose.bones[parts.FACE], controls.evaluated_get(depsgraph)
    maximum = parts.maximum_of(controls)
    raw, _turns = inputs.read_inputs(seen, live, depsgraph, maximum)
    start = inputs.read_leading(seen, live).astype(np.float64)
    gain = _gains(seen, live, depsgraph, maximum, start)
    where = {label: i for i, label in enumerate(live.labels)}
    followers = sides.followers(controls)
    linked = [(where[a], where[b]) for b, a in followers.items() if a in where and b in where]
    driven = _driven(controls) - set(followers)
    there = np.array([n in bone and n not in driven for n in live.labels], bool)
    lowest = np.array(live.lowest, np.float64)
    one, other = raw + gain * (lowest - start), raw + gain * (maximum - start)
    return Sliders(
        before={name: bone[name] for name in live.labels if name in bone},
        start=start,
        seen=raw,
        gain=np.where(np.abs(gain) > _LEAST, gain, 1.0),
        free=there & (np.abs(gain) > _LEAST),
        low=np.minimum(one, other),
        high=np.maximum(one, other),
        linked=linked,
        places=board.places_of(controls, live) if board.leads(controls, live) else {},
    )


def write(
    rig: ArmatureObject, live: runtime.Runtime, sliders: Sliders, raw: NDArray[np.float32]
) -> list[str]:
    """Set the sliders, or a leading board, so that the face shows given raw controls.

    Args:
        rig: the character.
        live: Runtime of the character.
        sliders: sliders at the start of the drag.
        raw: float32[R], wanted raw controls.

    Returns:
        The names of sliders that differ from the start.
    """
    controls = parts.controls_there(rig)
    if sliders.places:
        return _write_board(rig, live, sliders, raw)
    bone, maximum = controls.pose.bones[parts.FACE], parts.maximum_of(controls)
    followers = {follower for _, follower in sliders.linked}
    moved = []
    for i, value in enumerate(sliders.values(raw).tolist()):
        name = live.labels[i]
        if name not in sliders.before or i in followers:
            continue
        if value == sliders.start[i]:
            bone[name] = sliders.before[name]
            continue
        low, high = min(live.lowest[i], sliders.start[i]), max(maximum, sliders.start[i])
        bone[name] = min(max(value, low), high)
        moved.append(name)
    controls.update_tag()
    return moved


def _write_board(
    rig: ArmatureObject, live: runtime.Runtime, sliders: Sliders, raw: NDArray[np.float32]
) -> list[str]:
    """`write` for a leading face board: its handles move from their start to the nearest pose.

    Args:
        rig: the character.
        live: Runtime of the character.
        sliders: sliders at the start of the drag.
        raw: float32[R], wanted raw controls.
    """
    board.put_places(parts.controls_there(rig), live, sliders.places)
    values = sliders.values(raw)
    moved = {
        live.labels[i]: float(values[i])
        for i in np.flatnonzero(values != sliders.start)
        if live.labels[i] in sliders.before
    }
    sides.put(rig, moved)
    return list(moved)


def restore(rig: ArmatureObject, sliders: Sliders) -> None:
    """Restore all sliders and handles.

    Args:
        rig: the character.
        sliders: sliders at the start of the drag.
    """
    sides.restore(rig, sides.Held(sliders.before, sliders.places))
    parts.controls_there(rig).update_tag()


def mirrored_indices(live: runtime.Runtime) -> NDArray[np.int64]:
    """int64[R]: index of each control's partner on the other side, or its own index."""
    where = {label: i for i, label in enumerate(live.labels)}
    partner = native.regions().mirrored
    return np.array([where.get(partner(n), i) for n, i in where.items()], np.int64)


def of_region(live: runtime.Runtime, region: str) -> NDArray[np.bool_]:
    """bool[R]: whether a raw control is in a region.

    Args:
        live: Runtime of the character.
        region: name of the region.
    """
    of_slider = native.regions().of_slider
    return np.array([of_slider(label) == region for label in live.labels], bool)


def _gains(
    seen: ArmatureObject,
    live: runtime.Runtime,
    depsgraph: Depsgraph,
    maximum: float,
    start: Float,
) -> Float:
    """float64[R]: change of the raw control divided by a small change of the slider; 1 without
    layers.

    Each slider is changed alone, because layers can suppress one of two opposite controls, such as
    looking left and right.

    Args:
        seen: the evaluated control armature.
        live: Runtime of the character.
        depsgraph: graph in which the controls were evaluated.
        maximum: largest value of a slider.
        start: float64[R], values of the sliders.
    """
    gain = np.ones(len(start))
    if not layers.has_any(seen.original):
        return gain

    def mixed(values: NDArray[np.float32]) -> NDArray[np.float32]:
        return layer_mixing.mix(seen, live, values, layer_mixing.Bones(), depsgraph, maximum)[0]

    base = start.astype(np.float32)
    before = mixed(base)
    for i in range(len(base)):
        tried = base.copy()
        tried[i] += _TRIED if base[i] + _TRIED <= maximum else -_TRIED
        gain[i] = (float(mixed(tried)[i]) - float(before[i])) / (float(tried[i]) - float(base[i]))
    return gain


def _driven(controls: ArmatureObject) -> set[str]:
    """The sliders that a driver moves, by name."""
    data = controls.animation_data
    paths = {curve.data_path for curve in data.drivers} if data is not None else set()
    bone = controls.pose.bones[parts.FACE]
    return {n for n in bone.keys() if parts.property_path(n) in paths} if paths else set()  # noqa: SIM118
