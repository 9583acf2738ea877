# SPDX-License-Identifier: GPL-3.0-or-later
"""Assigns the shape keys of a head to controls or expressions, by their names or by the user.

The mesh stores the user's assignments as text in the format of `risorius author --names`, so saving
and loading copy this text.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import bpy

from ... import native
from ...language import tables
from ...logic.character import slider_words
from ..base import parts, saved, session
from ..base.blender_types import MeshObject

Said = str | list[str]  # the user's assignment of a key, see risorius.author.input.said
CONTROL, EXPRESSION, OWN, NOTHING, MUTED = "CONTROL", "EXPRESSION", "OWN", "NOTHING", "MUTED"
WORDS = "WORDS"  # Row.by of a name that was recognised by its words and by no vocabulary
_UNITS, _CONTROLS = "arkit", "metahuman"  # vocabularies


class Row(NamedTuple):
    """The assignment of a shape key.

    Attributes:
        key: name of the key.
        kind: CONTROL: standard raw controls; EXPRESSION; OWN: a new control for this key; NOTHING:
            left out by the user; MUTED: left out because the key is muted.
        controls: raw controls without prefix.
        expression: name of the expression, or "".
        by: title of the vocabulary that contains the name; WORDS if the name was recognised by its
            words; "" if it was not recognised.
        is_known: whether the name of the key is known, regardless of the user's assignment.
        is_said: whether the user assigned the key.
        holder: name of another key. The name of an OWN key may mean a standard control that is
            assigned to this other key already; "" if there is no such key.
    """

    key: str
    kind: str
    controls: tuple[str, ...]
    expression: str
    by: str
    is_known: bool
    is_said: bool
    holder: str


class Names(NamedTuple):
    """The shape keys of a head: name of the key -> Row, in the order of the keys."""

    rows: Mapping[str, Row]

    @property
    def unknown(self) -> int:
        """The number of keys whose name is unknown and that the user has not assigned."""
        return sum(not row.is_known and not row.is_said for row in self.rows.values())


def of(item: MeshObject) -> Names:
    """The assignments of the shape keys of a head.

    Args:
        item: mesh with shape keys.
    """
    keys = parts.keys_there(item)
    names = tuple(key.name for key in keys.key_blocks if key != keys.reference_key)
    muted = frozenset(key.name for key in keys.key_blocks if key.mute)
    return _names(names, muted, saved.text(item.data, parts.NAMES))


def said_of(item: MeshObject) -> dict[str, Said]:
    """The user's assignments: name of the key -> assignment.

    Args:
        item: any mesh object; without assignments the result is empty.
    """
    return dict(_parsed(saved.text(item.data, parts.NAMES)))


def put(item: MeshObject, said: Mapping[str, Said | None]) -> None:
    """Store the user's assignments of keys.

    Args:
        item: the head.
        said: name of the key -> assignment; None removes the assignment, so that the key's name
            decides. The assignments of other keys are unchanged.

    Raises:
        GivenError: an unknown ARKit unit, or an invalid name of an expression; nothing is stored.
    """
    module, table = native.part("author.input.said"), said_of(item)
    for key, value in said.items():
        if value is None:
            table.pop(key, None)
        else:
            table[key] = module.check(value)
    if table:
        item.data[parts.NAMES] = module.text_of(table)
    elif parts.NAMES in item.data:
        del item.data[parts.NAMES]


def own_control(key: str) -> str:
    """The name of a new control that belongs only to this key.

    Args:
        key: name of the key; it may contain letters that are invalid in controls.
    """
    found: str = native.part("author.input.matching").own_control(key)
    return found


@session.cached(("unregister",), 64)
def _parsed(text: str) -> Mapping[str, Said]:
    """Parse stored assignments; empty if the text is invalid."""
    if not text:
        return {}
    try:
        found: dict[str, Said] = native.part("author.input.said").parse(text)
    except (*native.user_errors(), ValueError):
        return {}
    return found


@session.cached(("unregister",), 16)
def _names(names: tuple[str, ...], muted: frozenset[str], text: str) -> Names:
    matching = native.part("author.input.matching")
    said = {key: value for key, value in _parsed(text).items() if key in names}
    used = [name for name in names if name not in muted]
    became, alone = matching.assign(used, said), matching.assign(names, {})
    holders = {control: name for name, found in became.controls.items() for control in found}
    rows = {}
    for name in names:
        by = alone.by[name]
        controls = tuple(became.controls.get(name, ()))
        expression = became.expressions.get(name, "")
        kind = _kind(controls, expression) if name not in muted else MUTED
        wanted = _wanted(said[name]) if name in said else matching.guess(name)
        taken = (holders.get(control, name) for control in wanted) if kind == OWN else ()
        holder = next((other for other in taken if other != name), "")
        is_said = name in said
        rows[name] = Row(name, kind, controls, expression, _title(by), bool(by), is_said, holder)
    return Names(rows)


def _wanted(said: Said) -> tuple[str, ...]:
    """The raw controls, without prefix, that a user's assignment names.

    Args:
        said: the assignment as it is stored.
    """
    controls: tuple[str, ...] = native.part("author.input.said").meaning_of(said).controls
    return controls


def _kind(controls: tuple[str, ...], expression: str) -> str:
    if expression:
        return EXPRESSION
    if not controls:
        return NOTHING
    return CONTROL if standard_controls().issuperset(controls) else OWN


def _title(by: str) -> str:
    if by in native.part("controls.vocabulary").names():
        return str(native.part("controls.vocabulary").vocabulary(by).title)
    return by and WORDS


@session.cached(("unregister",), 1)
def standard_controls() -> frozenset[str]:
    """The raw controls of a standard face, without prefix."""
    return frozenset(native.part("controls.vocabulary").vocabulary(_CONTROLS).meanings)


class Choice(NamedTuple):
    """A possible assignment of a key.

    Attributes:
        value: the text that is stored for it.
        label: label in English.
        does: a sentence about its effect in English, or "".
        kind: CONTROL, EXPRESSION, or UNIT for an ARKit unit.
    """

    value: str
    label: str
    does: str
    kind: str


UNIT = "UNIT"


@session.cached(("unregister",), 1)
def choices() -> tuple[Choice, ...]:
    """All possible assignments of a key: first ARKit units, which most people know, then
    controls and expressions."""
    vocabulary, words = native.part("controls.vocabulary"), tables.controls()
    units = [
        Choice(f"={unit}", slider_words.title(unit), "", UNIT)
        for unit in vocabulary.vocabulary(_UNITS).meanings
    ]
    controls = [
        Choice(name, slider_words.title(name), words.tooltip(name), CONTROL)
        for name in vocabulary.vocabulary(_CONTROLS).meanings
    ]
    own = native.part("expressions").load()
    expressions = [
        Choice(f"@{name}", one.label, one.description, EXPRESSION)
        for name, one in own.items()
        if one.weights
    ]
    return (*units, *controls, *expressions)


@session.cached(("unregister",), 512)
def unit_of(controls: tuple[str, ...]) -> str:
    """The ARKit unit that drives exactly these controls, or "".

    Args:
        controls: names of raw controls, without prefix.
    """
    prefix, meant = native.part("controls.vocabulary").PREFIX, set(controls)
    for unit, row in native.part("controls.arkit").mapping().items():
        if {name.removeprefix(prefix) for name in row} == meant:
            return str(unit)
    return ""


@session.cached(("unregister",), 1024)
def weights_of(value: str) -> Mapping[str, float]:
    """Raw control with prefix -> its value, for the picture of a possible assignment.

    Args:
        value: value of a Choice.
    """
    prefix = native.part("controls.vocabulary").PREFIX
    if value.startswith("@"):
        own = native.part("expressions").load().get(value[1:])
        return dict(own.weights) if own is not None else {}
    if value.startswith("="):
        return dict(native.part("controls.arkit").mapping()[value[1:]])
    return {prefix + value: 1.0}


def is_editable(item: bpy.types.Object) -> bool:
    """Whether assignments can be stored on a mesh; False if it is linked from another file."""
    return item.data is not None and item.data.is_editable
