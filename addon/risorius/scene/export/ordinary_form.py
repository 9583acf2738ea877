# SPDX-License-Identifier: GPL-3.0-or-later
"""Switches faces out of Direct mode while one of Blender's own exporters works.

Exporters read the stored bones and shape keys. In Direct mode the bones stay at rest and the live
keys have final positions, so the exported face would be deformed twice or not at all.
"""

from __future__ import annotations

from typing import cast

import bpy

from ..base import parts, session
from ..base.blender_types import Depsgraph, current_context
from ..frame import evaluate
from ..skinning import conditions

_LOOK_AGAIN = 0.5  # seconds between two checks whether an export dialog is open

DIALOG, GLTF = "dialog", "gltf"  # readers: an export dialog, the glTF exporter
# DIALOG or GLTF -> names of the deforming armatures that may not use Direct mode while this reader
# of the faces works.
_held: dict[str, list[str]] = session.table("ordinary_form.held", ("load",))
_drawing = session.value("ordinary_form.drawing", cast("object", None), ("quit",))


def begin(reader: str) -> None:
    """Keep all faces out of Direct mode until `end` is called; a timer calls `end` for GLTF.

    Args:
        reader: DIALOG (an export dialog is open) or GLTF (the glTF exporter writes). A second call
            for the same reader has no effect until `end` is called.
    """
    if reader in _held:
        return
    rigs = parts.rigs()
    _held[reader] = [rig.name for rig in rigs]
    for rig in rigs:
        conditions.hold_ordinary(rig, on=True)
    _bring_up()
    if reader == GLTF and not bpy.app.timers.is_registered(_let_go):
        # An exporter that fails never calls `end`, so a timer calls it.
        bpy.app.timers.register(_let_go, first_interval=_LOOK_AGAIN)


def end(reader: str) -> None:
    """Let faces use Direct mode again after a reader has finished.

    Args:
        reader: DIALOG or GLTF, as in the call of `begin`.
    """
    names = _held.pop(reader, None)
    if names is None:
        return
    for rig in parts.rigs():
        if rig.name in names:
            conditions.hold_ordinary(rig, on=False)
    _bring_up()


def _bring_up() -> None:
    for scene in bpy.data.scenes:
        for layer in scene.view_layers:
            if layer.depsgraph is not None:
                evaluate.evaluate_all(cast("Depsgraph", layer.depsgraph))
                layer.update()


def register() -> None:
    """Begin to watch for export dialogs."""
    if _drawing.now is None:
        space = bpy.types.SpaceFileBrowser
        _drawing.now = space.draw_handler_add(_drawn, (), "WINDOW", "POST_PIXEL")


def unregister() -> None:
    """Stop watching for export dialogs."""
    if _drawing.now is not None:
        bpy.types.SpaceFileBrowser.draw_handler_remove(_drawing.now, "WINDOW")
        _drawing.now = None
    for timer in (_watch, _let_go):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    _held.clear()


def _drawn() -> None:
    """Called when a file browser is drawn. A timer does the work, because drawing code must not
    edit data."""
    space = cast("bpy.types.Space | None", current_context().space_data)
    if _exports(space) and not bpy.app.timers.is_registered(_watch):
        bpy.app.timers.register(_watch, first_interval=0.0)


def _watch() -> float | None:
    windows = current_context().window_manager.windows
    areas = (area for window in windows for area in window.screen.areas)
    if any(_exports(cast("bpy.types.Space", area.spaces.active)) for area in areas):
        begin(DIALOG)
        return _LOOK_AGAIN
    end(DIALOG)
    return None


def _let_go() -> None:
    end(GLTF)


def _exports(space: bpy.types.Space | None) -> bool:
    """Whether a file browser is the dialog of one of Blender's exporters."""
    if space is None or space.type != "FILE_BROWSER":
        return False
    operator = cast("bpy.types.SpaceFileBrowser", space).active_operator
    if operator is None:
        return False
    name = operator.bl_idname.lower()
    return "export" in name and not name.startswith("risorius")
