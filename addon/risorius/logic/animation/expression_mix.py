# SPDX-License-Identifier: GPL-3.0-or-later
"""Blends an expression into the slider values of a face: strength, regions, flip, addition."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from ..base.face_regions import FaceRegions


@dataclass(frozen=True)
class Way:
    """Options of blending an expression.

    Attributes:
        strength: 1 sets the expression, 0 changes nothing; below 0 it is subtracted if `additive`
            is True.
        others_to_rest: True: other sliders are blended to rest by `strength`. It has no effect on
            an expression that names its regions, or if `additive` is True.
        flip: True: left and right of the expression are swapped.
        additive: True: the expression is added to the current pose; other sliders do not move.
        regions: only sliders of these regions move; empty for all regions.
    """

    strength: float = 1.0
    others_to_rest: bool = True
    flip: bool = False
    additive: bool = False
    regions: frozenset[str] = frozenset()

    def at(self, strength: float) -> Way:
        """The same options with another strength."""
        return replace(self, strength=strength)


def mixed(
    present: Mapping[str, float],
    weights: Mapping[str, float],
    rests: Mapping[str, float],
    way: Way,
    regions: FaceRegions,
    held: Collection[str] = (),
) -> dict[str, float]:
    """The blended values of the sliders that move; they may exceed the sliders' limits.

    Args:
        present: current values of the sliders, by name.
        weights: slider -> weight of the expression; sliders that the face lacks are left out.
        rests: values of the sliders at rest.
        way: options of blending.
        regions: regions of the face.
        held: regions that a partial expression sets: sliders of these regions that have no weight
            go to rest, other regions stay; empty for a whole expression.
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
    """Swap the weights of left and right sliders; a slider without a partner keeps its weight.

    Args:
        goals: slider -> weight of the expression.
        present: names of all sliders of the face; a partner outside of them does not count.
        regions: regions of the face, which find the partners.
    """
    found = {}
    for name, value in goals.items():
        other = regions.mirrored(name)
        found[other if other in present else name] = value
    return found


def regions_in_use(
    values: Mapping[str, float], rests: Mapping[str, float], regions: FaceRegions
) -> set[str]:
    """The regions of all sliders that are not at rest.

    Args:
        values: current values of the sliders, by name.
        rests: values of the sliders at rest, by name.
        regions: regions of the face.
    """
    moved = (name for name, value in values.items() if abs(value - rests[name]) > 1e-6)
    return {regions.of_slider(name) for name in moved}


def dragged(pixels: float, per_unit: float, fine: bool) -> float:
    """The change of strength for a drag of the mouse.

    Args:
        pixels: distance of the pointer to the right since the last event, in pixels.
        per_unit: pixels for a change of the strength by 1.
        fine: True: the change is a tenth of the normal change, as with Blender's sliders.
    """
    return pixels / per_unit * (0.1 if fine else 1.0)
