# SPDX-License-Identifier: GPL-3.0-or-later
"""Applies expressions to the sliders of a face, and makes expressions from its pose."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from ... import native
from ...logic.animation import expression_mix
from ...logic.animation.expression_mix import Way
from ...logic.base.sentences import told
from ..animation import clip_actions
from ..base.blender_types import ArmatureObject
from ..character import runtime, sides
from .library import RISORIUS, Item, LibraryError

_MOUTH = {"mouth", "jaw", "tongue"}


def weights_for(live: runtime.Runtime, expression: native.Expression) -> dict[str, float]:
    """The slider values of an expression, without sliders that the face lacks.

    Args:
        live: the character's Runtime.
        expression: an expression with weights by the DNA's control names.

    Returns:
        Property name -> value.
    """
    sliders = clip_actions.sliders_of(live)
    return {sliders[n]: float(w) for n, w in expression.weights.items() if n in sliders}


def check(live: runtime.Runtime, item: Item) -> None:
    """Check that a face can show an expression.

    Args:
        live: the character's Runtime.
        item: an expression of the grid.

    Raises:
        LibraryError: the face lacks all controls of a built-in expression, or at least one control
            of the user's own expression.
    """
    sliders = clip_actions.sliders_of(live)
    weights = item.expression.weights
    lacking = [name for name in weights if name not in sliders]
    if len(lacking) == len(weights) > 0 or (lacking and item.source != RISORIUS):
        raise LibraryError(
            told(
                "{label} was made for another rig: this face lacks {count} of its {all} controls, "
                "such as {name}.",
                label=item.expression.label,
                count=len(lacking),
                all=len(weights),
                name=lacking[0],
            )
        )


def goals(
    rig: ArmatureObject, item: Item, way: Way, present: Mapping[str, float] | None = None
) -> dict[str, float]:
    """The slider values after blending an expression onto a pose, not clamped to slider limits.

    Args:
        rig: the character.
        item: an expression of the grid.
        way: options of the blending.
        present: values to start from; None: the current values.

    Raises:
        LibraryError: the expression was made for another rig.
    """
    live = runtime.there(rig)
    check(live, item)
    return expression_mix.mixed(
        sides.values_of(rig) if present is None else present,
        weights_for(live, item.expression),
        dict(zip(live.labels, live.rests, strict=True)),
        way,
        native.regions(),
        item.expression.regions,
    )


def apply(
    rig: ArmatureObject, item: Item, way: Way, present: Mapping[str, float] | None = None
) -> list[str]:
    """Blend an expression onto the sliders of a face.

    Args:
        rig: the character.
        item: an expression of the grid.
        way: options of the blending.
        present: values to start from; None: the current values.

    Returns:
        The property names of the sliders that the blend sets, also of linked sliders, which stay.

    Raises:
        LibraryError: the expression was made for another rig; nothing was moved.
    """
    values = goals(rig, item, way, present)
    sides.put(rig, values)
    return list(values)


def captured(
    rig: ArmatureObject,
    name: str,
    label: str,
    group: str,
    values: Mapping[str, float],
    regions: Collection[str] = (),
) -> native.Expression:
    """Make an expression from slider values.

    Args:
        rig: the character.
        values: values by slider names.
        name: name of the expression.
        label: label for panels.
        group: group of the expression.
        regions: regions of the expression; empty: all regions with a slider that is not at rest.

    Raises:
        LibraryError: all sliders of these regions are at rest.
    """
    live = runtime.there(rig)
    rests = dict(zip(live.labels, live.rests, strict=True))
    known = native.regions()
    moved = expression_mix.regions_in_use(values, rests, known)
    held = [region for region in known.titles if region in (set(regions) or moved)]
    names = dict(zip(live.labels, clip_actions.dna_names(live, live.labels), strict=True))
    weights = {
        names[label]: round(value, 6)
        for label, value in values.items()
        if known.of_slider(label) in held and abs(value - rests[label]) > 1e-6
    }
    if not weights:
        raise LibraryError(told("Move some sliders first: this face is at rest."))
    return native.part("expressions").Expression(name, label, group, "", weights, tuple(held))


def held_by(expression: native.Expression, weights: Iterable[str]) -> set[str]:
    """The regions that an expression names; if it names no regions, the regions of its sliders.

    A viseme that names no regions also has the regions mouth, jaw and tongue.

    Args:
        expression: the expression.
        weights: names of the sliders of this face to which the expression gives a value.
    """
    if expression.regions:
        return set(expression.regions)
    held = {native.regions().of_slider(name) for name in weights}
    return held | _MOUTH if expression.group == "viseme" else held


def pose_for(live: runtime.Runtime, expression: native.Expression) -> dict[str, float]:
    """Values of all sliders in the regions of an expression, as its pose asset contains them.

    Args:
        live: the character's Runtime.
        expression: the expression.

    Returns:
        Property name -> value.
    """
    weights = weights_for(live, expression)
    held = held_by(expression, weights)
    pose = {
        label: rest
        for label, rest in zip(live.labels, live.rests, strict=True)
        if native.regions().of_slider(label) in held
    }
    return {**pose, **weights}
