# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes pose assets of expressions in the open .blend file, with catalogues and pictures."""

from __future__ import annotations

import uuid
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ... import native
from ...logic.animation import clip_units as clip_logic
from ..animation import actions, clip_actions
from ..base.blender_types import ArmatureObject
from ..character import runtime
from . import poses, thumbnails
from .library import MARK

CATALOG = "Faces"  # the parent catalogue
_NAMESPACE = uuid.UUID("6f0a5c9e-2f0b-4d2e-9a3b-0d9f6f0b7a11")
_CATALOG_FILE = "blender_assets.cats.txt"
_HEADER = "# Asset catalogues of Blender\n\nVERSION 1\n\n"


def all_expressions() -> dict[str, native.Expression]:
    """Name -> built-in expression, in the order of the files of expressions."""
    return native.part("expressions").load()


def groups() -> dict[str, list[native.Expression]]:
    """Group -> built-in expressions of the group, in the order of the files."""
    found = {}
    for expression in all_expressions().values():
        found.setdefault(expression.group, []).append(expression)
    return found


def make_assets(rig: ArmatureObject) -> tuple[list[bpy.types.Action], list[str]]:
    """Make a pose asset of every built-in expression that this face can show.

    An asset contains all sliders of the regions of its expression, so that the result does not
    depend on the earlier pose. An existing asset is replaced unless it was edited.

    Args:
        rig: the character.

    Returns:
        The actions, and sentences for the user.
    """
    live = runtime.there(rig)
    made, left_out = [], []
    for expression in all_expressions().values():
        if expression.weights and not poses.weights_for(live, expression):
            left_out.append(expression.label)
            continue
        made.append(make_asset(rig, expression))
    notes = write_catalogs({e.group for e in all_expressions().values()})
    if left_out:
        notes.append(f"This face has no control of: {', '.join(left_out)}.")
    return made, notes


def make_asset(rig: ArmatureObject, expression: native.Expression) -> bpy.types.Action:
    """Make the pose asset of an expression, with its picture if the picture file exists.

    Args:
        rig: the character.
        expression: an expression that the face can show.

    Returns:
        The action; an unedited action of the same name is replaced.
    """
    pose = poses.pose_for(runtime.there(rig), expression)
    clip = native.module().Clip(list(pose), [[value] for value in pose.values()])
    # The action of a viseme is named after the viseme's name. Other actions are named after the
    # expression's label; the label of a viseme is only meant for panels.
    sound = expression.group == "viseme"
    name = f"Face {expression.name if sound else expression.label}"
    old = _named(name)
    name = old.name if old is not None else name
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
    for region in sorted(
        poses.held_by(expression, poses.weights_for(runtime.there(rig), expression))
    ):
        asset.tags.new(region, skip_if_exists=True)
    # Store the expression in the asset data too, which an asset shelf reads without loading a file.
    action[MARK] = asset[MARK] = native.part("expressions").text_of(expression)
    give_picture(action, picture_of(rig, expression))
    return action


def _named(name: str) -> bpy.types.Action | None:
    """The action with the given name, or None.

    Case is ignored, because older versions of the add-on used lower case names.
    """
    wanted = name.casefold()
    return next((action for action in bpy.data.actions if action.name.casefold() == wanted), None)


def picture_of(rig: ArmatureObject, expression: native.Expression) -> Path:
    """The path of the picture of an expression on a character; the file may be missing.

    Args:
        rig: the character.
        expression: the expression.
    """
    weights = poses.weights_for(runtime.there(rig), expression)
    return thumbnails.path_of(thumbnails.look_of(rig), weights)


def give_picture(action: bpy.types.Action, path: Path) -> bool:
    """Set the preview picture of an asset.

    Args:
        action: the asset.
        path: path of the PNG file.

    Returns:
        Whether the preview was set; False if the file is missing or no PNG.
    """
    try:
        image = native.part("files.png").read_png(path.read_bytes())
    except OSError:
        return False
    if image is None:
        return False
    shown = action.preview_ensure()
    if shown is None:
        return False
    height, width = image.shape[:2]
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = image
    shown.image_size = (width, height)
    floats: Any = shown.image_pixels_float
    floats.foreach_set(pixels.ravel())
    return True


def catalog_id(group: str) -> uuid.UUID:
    """The UUID of a group's catalogue, the same in every file."""
    return uuid.uuid5(_NAMESPACE, group)


def write_catalogs(wanted: Iterable[str]) -> list[str]:
    """Write the catalogues into Blender's catalogue file beside the .blend.

    Args:
        wanted: names of groups of expressions, each of which gets a catalogue.

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
            plain = "".join(c for c in group if c not in ":/\\" and c.isprintable()) or "own"
            title = f"{plain[:1].upper()}{plain[1:]}s"
            text = f"{text.rstrip()}\n{number}:{CATALOG}/{title}:{CATALOG}-{title}\n"
    # All .blend files of the folder share the file, so write it atomically.
    native.part("files.fileio").write_text(path, text)
