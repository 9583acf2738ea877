# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts about assignments of shape keys, and the active key of a head."""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from ...logic.character import slider_words
from ...scene.base import parts, session
from ...scene.base.blender_types import MeshObject
from ...scene.shape_keys import assigned
from .. import words


def active_key(item: MeshObject) -> str:
    """The name of the active shape key.

    Args:
        item: mesh object with shape keys.
    """
    keys = parts.keys_there(item).key_blocks
    return keys[min(item.active_shape_key_index or 0, len(keys) - 1)].name


def label_of_choice(choice: assigned.Choice) -> str:
    """The label of a control or expression in the list of choices, in which the user searches.

    Args:
        choice: one of assigned.choices.
    """
    if choice.kind == assigned.UNIT:
        return f"{choice.label} (ARKit)"
    if choice.kind == assigned.EXPRESSION:
        return words.say("Expression: {label}", label=words.say(choice.label))
    return choice.label


def tooltip_of_choice(choice: assigned.Choice) -> str:
    """The tooltip of a choice in the user's language. Args: choice  one of assigned.choices."""
    return (bpy.app.translations.pgettext_tip(choice.does) or "") if choice.does else ""


def becomes(row: assigned.Row) -> str:
    """A shape key's assignment in a few words of the user's language: the control or expression.

    Args:
        row: row of the shape key, from assigned.of.
    """
    if row.kind == assigned.EXPRESSION:
        own = _expressions().get(row.expression)
        label = words.say(own.label) if own is not None else row.expression
        return words.say("Expression: {label}", label=label)
    if row.kind == assigned.CONTROL:
        return words_of_controls(row.controls)
    return words.say(
        {
            assigned.OWN: words.mark("A control of its own"),
            assigned.NOTHING: words.mark("Left out"),
            assigned.MUTED: words.mark("Muted: left out"),
        }[row.kind]
    )


def who_knows(row: assigned.Row) -> str:
    """A sentence that says who assigned a shape key: the user, a vocabulary, or nobody.

    If another shape key already has the control, the sentence names this other shape key.

    Args:
        row: row of the shape key, from assigned.of.
    """
    if row.holder:
        return words.say(
            (
                "This name means a control that is already assigned to the shape key "
                "{name}; a control can have only one shape key."
            ),
            name=row.holder,
        )
    if row.is_said:
        return words.say("You assigned this shape key.")
    if not row.by:
        return words.say("No vocabulary knows this name.")
    name = words.say("Words") if row.by == assigned.WORDS else row.by
    return words.say("Name found in the vocabulary {name}", name=name)


def words_of_controls(controls: tuple[str, ...]) -> str:
    """A short text for controls, for example "Jaw Open".

    It is the title of a single control, or the ARKit shape that equals the controls together, or
    the title of the first control and the number of the others.

    Args:
        controls: names of controls without their prefix.
    """
    if len(controls) == 1:
        return slider_words.title(controls[0])
    unit = assigned.unit_of(controls)
    if unit:
        return f"{slider_words.title(unit)} (ARKit)"
    first = slider_words.title(controls[0])
    return words.say("{name} and {count} more", name=first, count=len(controls) - 1)


def words_of_value(value: str) -> str:
    """A control or expression in a few words, in the user's language.

    Args:
        value: value of an assigned.Choice; "": the words for a key that is left out; a value that
            no choice has is returned unchanged.
    """
    if not value:
        return words.say("Left out")
    choice = next((c for c in assigned.choices() if c.value == value), None)
    return label_of_choice(choice) if choice is not None else value


def value_of(row: assigned.Row) -> assigned.Said:
    """A shape key's assignment as a file of assignments stores it.

    Args:
        row: row of the shape key, from assigned.of.
    """
    if row.expression:
        return f"@{row.expression}"
    return row.controls[0] if len(row.controls) == 1 else list(row.controls)


def sample_of(row: assigned.Row) -> str:
    """The value of the assigned.Choice that a shape key is assigned to; "" for none.

    If the key is assigned to several controls that no ARKit shape stands for, the result is the
    first control. The panel shows the sample man's picture for this value.

    Args:
        row: row of the shape key, from assigned.of.
    """
    if row.kind == assigned.EXPRESSION:
        return f"@{row.expression}" if row.expression in _expressions() else ""
    if row.kind != assigned.CONTROL:
        return ""
    unit = assigned.unit_of(row.controls)
    return f"={unit}" if unit else next(iter(row.controls))


@session.cached(("unregister",), 1)
def _expressions() -> Mapping[str, assigned.Choice]:
    return {c.value[1:]: c for c in assigned.choices() if c.kind == assigned.EXPRESSION}
