# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's own animation editors show."""

import bpy


def seen_paths():
    """Data paths of the F-curves that a graph editor with its own settings shows now."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    before, area.type = area.type, "GRAPH_EDITOR"
    bpy.context.view_layer.update()
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        found = {c.data_path for c in bpy.context.visible_fcurves or ()}
    area.type = before
    return found
