# SPDX-License-Identifier: GPL-3.0-or-later
"""Blending an expression into a face's sliders: strength, regions, flip, addition."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from ..base.face_regions import FaceRegions


@dataclass(frozen=True)
class Way:
    """Options of blending an expression.

    Attributes:
        strength: 1 sets it, 0 changes nothing; with `additive` a value below 0 subtracts it.
        others_to_rest: move other sliders to rest by the same share.
        flip: swap left and right.
        additive: add it to the current pose, without moving other sliders to rest.
        regions: move sliders of these regions only; none: all.
    """

    strength: float = 1.0
    others_to_rest: bool = True
    flip: bool = False
    additive: bool = False
    regions: frozenset[str] = frozenset()

    def at(self, strength: float) -> Way:
        """The same with another strength."""
        return replace(self, strength=strength)


def mixed(
    present: Mapping[str, float],
    weights: Mapping[str, float],
    rests: Mapping[str, float],
    way: Way,
    regions: FaceRegions,
    held: Collection[str] = (),
) -> dict[str, float]:
    """The new values of an expression's sliders, without limits.

    Args:
        present: values of the existing sliders by name.
        weights: weights of the expression by slider; missing sliders are left out.
        rests: values of the sliders at rest.
        way: options of blending.
        regions: of the face.
        held: regions of the expression: other regions stay, and unmoved sliders of these regions go
            to rest.
    """
    goals = {name: value for name, value in weights.items() if name in present}
    if way.flip:
        goals = _flipped(goals, present, regions)
    if way.additive:
        found = {n: present[n] + way.strength * (g - rests[n]) for n, g in goals.items()}
    else:
        wide = way.others_to_rest or bool(held)
        for name in present if wide else ():
            if not held or regions.of_slider(name) in held:
                goals.setdefault(name, rests[name])
        keep = 1.0 - way.strength
        found = {n: present[n] * keep + g * way.strength for n, g in goals.items()}
    if not way.regions:
        return found
    return {n: v for n, v in found.items() if regions.of_slider(n) in way.regions}


def _flipped(
    goals: Mapping[str, float], present: Collection[str], regions: FaceRegions
) -> dict[str, float]:
    """Swap left and right; a slider without a partner on this face keeps its value."""
    found = {}
    for name, value in goals.items():
        other = regions.mirrored(name)
        found[other if other in present else name] = value
    return found


def regions_in_use(
    values: Mapping[str, float], rests: Mapping[str, float], regions: FaceRegions
) -> set[str]:
    """The regions of sliders that are not at rest.

    Args:
        values: of the sliders, by name.
        rests: their values at rest.
        regions: of the face.
    """
    moved = (name for name, value in values.items() if abs(value - rests[name]) > 1e-6)
    return {regions.of_slider(name) for name in moved}


def dragged(pixels: float, per_unit: float, fine: bool) -> float:
    """How much strength a drag of the mouse is.

    Args:
        pixels: to the right since the last event.
        per_unit: pixels that a strength of 1 takes.
        fine: a tenth as much, as with Blender's sliders.
    """
    return pixels / per_unit * (0.1 if fine else 1.0)
