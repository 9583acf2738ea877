# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions on the sliders: set, keyed, or as pose assets in a catalogue of the file."""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Mapping
from pathlib import Path

import bpy

from ... import native
from ...logic.animation import clip_units as clip_logic
from ..base import parts
from ..base.blender_types import ArmatureObject
from ..character import runtime
from . import actions, clip_actions

CATALOG = "Faces"
_NAMESPACE = uuid.UUID("6f0a5c9e-2f0b-4d2e-9a3b-0d9f6f0b7a11")
_CATALOG_FILE = "blender_assets.cats.txt"
_HEADER = "# Asset catalogues of Blender\n\nVERSION 1\n\n"


def all_expressions() -> dict[str, native.Expression]:
    """Name -> risorius Expression, in the order of their files."""
    return native.part("expressions").load()


def groups() -> dict[str, list[native.Expression]]:
    """Group -> its expressions, in their order."""
    found = {}
    for expression in all_expressions().values():
        found.setdefault(expression.group, []).append(expression)
    return found


def weights_for(live: runtime.Runtime, expression: native.Expression) -> dict[str, float]:
    """The sliders of an expression, without those the face lacks.

    Args:
        live: the character's Runtime.
        expression: risorius.expressions.Expression, whose weights go by the DNA's control names.

    Returns:
        Property name -> value.
    """
    sliders = clip_actions.sliders_of(live)
    return {sliders[n]: float(w) for n, w in expression.weights.items() if n in sliders}


def apply(
    rig: ArmatureObject,
    expression: native.Expression,
    strength: float,
    others_to_rest: bool = False,
) -> list[str]:
    """Move the sliders towards an expression.

    Args:
        rig: the character.
        expression: risorius Expression.
        strength: 1 sets it, 0 changes nothing.
        others_to_rest: bring all other sliders to rest by the same share.

    Returns:
        The property names of the sliders that it concerns.
    """
    live, face, controls = runtime.there(rig), parts.face_bone(rig), parts.controls_there(rig)
    assert face is not None
    goals = weights_for(live, expression)
    if others_to_rest:
        goals = {**dict(zip(live.labels, live.rests, strict=True)), **goals}
    maximum, lowest = parts.maximum_of(controls), dict(zip(live.labels, live.lowest, strict=True))
    goals = {name: goal for name, goal in goals.items() if name in face}
    for name, goal in goals.items():
        value = float(face[name]) * (1.0 - strength) + goal * strength
        face[name] = min(max(value, lowest[name]), maximum)
    controls.update_tag()
    return list(goals)


def make_assets(rig: ArmatureObject) -> tuple[list[bpy.types.Action], list[str]]:
    """Make a pose asset of every expression that this face can show.

    An asset holds all sliders of the regions that its expression moves, so that it looks the same
    whatever the face did before; one that is there already is made anew, unless it was edited.

    Args:
        rig: the character.

    Returns:
        The actions, and sentences for the user.
    """
    live = runtime.there(rig)
    made, left_out = [], []
    for expression in all_expressions().values():
        weights = weights_for(live, expression)
        if expression.weights and not weights:
            left_out.append(expression.label)
            continue
        made.append(_asset(rig, live, expression, weights))
    notes = _write_catalogs({e.group for e in all_expressions().values()})
    if left_out:
        notes.append(f"This face has no control of: {', '.join(left_out)}.")
    return made, notes


def _asset(
    rig: ArmatureObject,
    live: runtime.Runtime,
    expression: native.Expression,
    weights: Mapping[str, float],
) -> bpy.types.Action:
    held = regions_of(expression, weights)
    pose = {
        label: rest
        for label, rest in zip(live.labels, live.rests, strict=True)
        if native.regions().of_slider(label) in held
    }
    pose.update(weights)
    clip = native.module().Clip(list(pose), [[value] for value in pose.values()])
    name = f"Face {expression.label}"
    old = bpy.data.actions.get(name)
    if old is not None and old.library is None and not actions.was_edited(old):
        bpy.data.actions.remove(old)
    action = clip_actions.make_action(rig, clip, clip_logic.Timing(24.0), name).action
    actions.stamp(action)
    action.asset_mark()
    asset = action.asset_data
    assert asset is not None
    asset.catalog_id = str(catalog_id(expression.group))
    asset.description = expression.description
    asset.tags.new(expression.group, skip_if_exists=True)
    return action


def regions_of(expression: native.Expression, weights: Iterable[str]) -> set[str]:
    """The regions that an expression moves; a viseme always the whole mouth.

    Args:
        expression: risorius.expressions.Expression.
        weights: the names of its sliders on this face, from weights_for.
    """
    held = {native.regions().of_slider(name) for name in weights}
    return held | {"mouth", "jaw", "tongue"} if expression.group == "viseme" else held


def catalog_id(group: str) -> uuid.UUID:
    """The number of a group's catalogue, the same in every file."""
    return uuid.uuid5(_NAMESPACE, group)


def _write_catalogs(wanted: Iterable[str]) -> list[str]:
    """Name the catalogues in the file beside the .blend, where Blender keeps them.

    Returns:
        Sentences for the user.
    """
    if not bpy.data.filepath:
        return ["Save the file and run this again to sort the poses into a catalogue."]
    path = Path(bpy.path.abspath("//")) / _CATALOG_FILE
    try:
        _add_catalogs(path, wanted)
    except (OSError, ValueError) as error:
        return [f"The poses have no catalogue, {path} cannot be changed: {error}"]
    return []


def _add_catalogs(path: Path, wanted: Iterable[str]) -> None:
    text = path.read_text(encoding="utf-8") if path.is_file() else _HEADER
    for group in sorted(wanted):
        number = str(catalog_id(group))
        if number not in text:
            title = f"{group[:1].upper()}{group[1:]}s"
            text = f"{text.rstrip()}\n{number}:{CATALOG}/{title}:{CATALOG}-{title}\n"
    # The file belongs to every .blend of the folder: it is whole at all times.
    native.part("files.fileio").write_text(path, text)
