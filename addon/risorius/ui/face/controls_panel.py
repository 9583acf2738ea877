# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Controls: one slider per control, grouped by region."""

from collections.abc import Sequence

import bpy

from ... import native
from ...logic.character import slider_words
from ...scene.base import parts
from ...scene.character import runtime
from .. import words
from ..blender_types import Context, Icon, Panel, UILayout
from ..common import FaceOnlyPanel, face_controls, face_rig

_ICONS: dict[str, Icon] = {
    "brow": "MOD_CURVE",
    "eye": "HIDE_OFF",
    "nose": "MONKEY",
    "cheek": "MATSPHERE",
    "mouth": "USER",
    "jaw": "MOD_SIMPLEDEFORM",
    "tongue": "MOD_SMOOTH",
    "teeth": "SNAP_FACE",
    "neck": "ARMATURE_DATA",
    "ear": "SPEAKER",
    "other": "DOT",
}
_OPEN = {"brow", "eye", "mouth", "jaw"}
_TITLE = 0.5  # of the width, for the names of sliders


class RISORIUS_PT_controls(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_controls"
    bl_label = "Controls"
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        rig = face_rig(context)
        live, face = runtime.of(rig), face_controls(context).pose.bones[parts.FACE]
        if live is None:
            return
        regions = native.regions()
        search = context.window_manager.risorius_search
        layout.prop(context.window_manager, "risorius_search", text="", icon="VIEWZOOM")
        shown = [n for n in live.labels if n in face and slider_words.matches(n, search)]
        for region, indices in slider_words.group_controls(shown, regions).items():
            names = [shown[i] for i in indices]
            if search:
                _draw_region_header(layout.row(), region)
                _draw_sliders(context, layout, face, region, names)
                continue
            header, body = layout.panel(
                f"RISORIUS_PT_region_{region}", default_closed=region not in _OPEN
            )
            _draw_region_header(header, region)
            if body is not None:
                _draw_sliders(context, body, face, region, names)
        if not shown:
            words.write(layout, "No control has these words in its name.", "INFO")


def _draw_region_header(layout: UILayout, region: str) -> None:
    layout.label(text=native.regions().titles[region], icon=_ICONS[region])
    row = layout.row(align=True)
    row.emboss = "NONE"
    row.operator("risorius.reset", text="", icon="LOOP_BACK").region = region
    row.operator("risorius.key", text="", icon="KEY_HLT").region = region


def _draw_sliders(
    context: Context, layout: UILayout, face: bpy.types.PoseBone, region: str, names: Sequence[str]
) -> None:
    """One line per control; a left and its right control share it, a long name stands above."""
    column = layout.column(align=True)
    ruler = words.Ruler(context, _TITLE)
    there = set(names)
    for name in names:
        left, right = f"{name[:-1]}L", f"{name[:-1]}R"
        if name == right and left in there:
            continue
        paired = name == left and right in there
        title = slider_words.title_in_region(name, region, sided=not paired)
        if ruler.fits(title):
            line = column.split(factor=_TITLE, align=True)
            line.label(text=title)
        else:
            column.label(text=title)
            line = column
        row = line.row(align=True)
        for one, text in ((left, "L"), (right, "R")) if paired else ((name, ""),):
            quoted = bpy.utils.escape_identifier(one)
            row.prop(face, f'["{quoted}"]', text=text, slider=True)


CLASSES = (RISORIUS_PT_controls,)
