# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs operators in Blender's animation editors, and lists their visible F-curves."""

from contextlib import contextmanager

import bpy


@contextmanager
def editor(kind):
    """Context manager in which operators run as in an editor of Blender.

    Args:
        kind: type of the editor, a value of bpy.types.Area.type such as "GRAPH_EDITOR".
    """
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    before, area.type = area.type, kind
    bpy.context.view_layer.update()
    region = next(r for r in area.regions if r.type == "WINDOW")
    try:
        with bpy.context.temp_override(window=window, area=area, region=region):
            yield
    finally:
        area.type = before


def seen_paths():
    """Data paths of the F-curves that a graph editor with default settings shows."""
    with editor("GRAPH_EDITOR"):
        return {c.data_path for c in bpy.context.visible_fcurves or ()}
