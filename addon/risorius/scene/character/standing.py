# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds controls that are not at rest and that no animation moves, to warn after an import.

Either the sliders or the face board lead, that is, move the face. A leading board replaces only the
sliders that its handles can move.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...logic.base.control_words import PREFIX
from ...logic.base.sentences import Sentence, told
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from . import board, runtime

_SEEN = 1e-3  # smaller differences from rest are ignored
_NAMED = 12  # number of controls that the sentence names


@dataclass(frozen=True)
class Standing:
    """Controls that are not at rest and that no action or driver moves.

    Attributes:
        sliders: values by name.
        handles: bones of the handles of a leading face board.
    """

    sliders: dict[str, float]
    handles: list[str]

    @property
    def sentence(self) -> Sentence | None:
        """The sentence for the user; None if there are no such controls."""
        values = {**self.sliders, **dict.fromkeys(self.handles)}
        if not values:
            return None
        shown = [
            name.removeprefix(PREFIX) + (f" {value:.2f}" if value is not None else "")
            for name, value in list(values.items())[:_NAMED]
        ]
        text = "It leaves these controls as they were: {names}."
        if len(values) > _NAMED:
            text = "It leaves these controls as they were: {names} and {count} more."
        return told(text, names=", ".join(shown), count=len(values) - _NAMED)


def beside(rig: ArmatureObject) -> Standing:
    """The controls of a face that are not at rest and that no action or driver moves.

    Args:
        rig: the character.
    """
    controls, live = parts.controls_there(rig), runtime.there(rig)
    face, data = controls.pose.bones[parts.FACE], controls.animation_data
    moved = {curve.data_path for curve in (data.drivers if data is not None else ())}
    for action in compat.played_actions(controls):
        moved |= {curve.data_path for curve in compat.curves_for(action, controls)}
    led = board.leads(controls, live)
    sliders = {}
    for index, (label, rest) in enumerate(zip(live.labels, live.rests, strict=True)):
        held = led and bool(live.table.reached[index])
        if label not in face or held or parts.property_path(label) in moved:
            continue
        if abs(float(face[label]) - rest) > _SEEN:
            sliders[label] = float(face[label])
    places = board.places_of(controls, live) if led else {}
    handles = [
        bone
        for bone, place in places.items()
        if board.path_of(bone) not in moved and max(map(abs, place)) > _SEEN
    ]
    return Standing(sliders, handles)


def bring_to_rest(rig: ArmatureObject, found: Standing) -> None:
    """Set controls to rest.

    Args:
        rig: the character.
        found: the controls, from `beside`.
    """
    controls, live = parts.controls_there(rig), runtime.there(rig)
    face = controls.pose.bones[parts.FACE]
    for label, rest in zip(live.labels, live.rests, strict=True):
        if label in found.sliders:
            face[label] = rest
    board.reset(controls, [h for h in live.handles if h.bone in found.handles])
