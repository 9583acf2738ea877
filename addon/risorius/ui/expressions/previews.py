# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of expressions as icons of Blender, loaded when they are first drawn."""

from pathlib import Path
from typing import Any

import bpy
import bpy.utils.previews

from ...scene.base import session
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from ...scene.expressions import poses, thumbnails
from ...scene.expressions.library import Item

# "icons" -> Blender's preview collection with the loaded pictures; empty until one is loaded.
_held: dict[str, Any] = session.table("previews.held", ("unregister",))


def icon_of(path: Path) -> int:
    """The number of Blender's icon for a picture file, or 0 if the file does not exist."""
    icons = _held.setdefault("icons", bpy.utils.previews.new()) if not _held else _held["icons"]
    key = str(path)
    if key not in icons:
        if not path.is_file():
            return 0
        icons.load(key, key, "IMAGE")
    return icons[key].icon_id


def load(path: Path) -> int:
    """The number of Blender's icon for a picture file, or 0 if the file does not exist.

    Blender reads the file at once, because a search list shows no picture that is read later.

    Args:
        path: path of the picture file.
    """
    icon = icon_of(path)
    if icon:
        _held["icons"][str(path)].icon_size  # noqa: B018  Blender reads the file when asked for it
    return icon


def forget() -> None:
    """Remove all icons: when the add-on is disabled, and before pictures are drawn again."""
    if _held:
        bpy.utils.previews.remove(_held.pop("icons"))


def jobs_of(rig: ArmatureObject, items: list[Item]) -> list[thumbnails.Job]:
    """One job for each expression: the picture file and the slider values that it shows.

    The jobs are in the order of `items`, also for expressions whose picture exists already.

    Args:
        rig: deforming armature of the character.
        items: the expressions.
    """
    live, look = runtime.there(rig), thumbnails.look_of(rig)
    weights = [poses.weights_for(live, item.expression) for item in items]
    return [thumbnails.Job(thumbnails.path_of(look, held), held) for held in weights]
