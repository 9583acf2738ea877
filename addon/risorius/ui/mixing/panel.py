# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Mix Faces: the faces with their shares, the preview and the file."""

from pathlib import Path

from ...logic.base import names
from ...scene.mixing import parents
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, FacePanel, active_controls
from .properties import REGIONS, choices


class RISORIUS_PT_mix(FacePanel, Panel):
    bl_idname = "RISORIUS_PT_mix"
    bl_label = "Mix Faces"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Whether no face is active.

        While a face is active, the panel Options contains a second panel Mix Faces instead, because
        on a laptop's screen the tab then has no room for one more panel.
        """
        return active_controls(context) is None

    def draw(self, context: Context) -> None:
        draw_mix(self.layout, context)


class RISORIUS_PT_mix_here(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_mix_here"
    bl_label = "Mix Faces"
    bl_parent_id = "RISORIUS_PT_options"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        draw_mix(self.layout, context)


def draw_mix(layout: UILayout, context: Context) -> None:
    """Draw the faces of the mix with their shares, and buttons that change, show and write the mix.

    Args:
        layout: layout of the panel.
        context: context of Blender.
    """
    rows = choices(context).parents
    for index, parent in enumerate(rows):
        box = layout.box()
        row = box.row(align=True)
        arrow = "TRIA_DOWN" if parent.show_regions else "TRIA_RIGHT"
        row.prop(parent, "show_regions", text="", icon=arrow, emboss=False)
        name = names.printable(Path(parent.path).stem, 40)
        row.prop(parent, "share", text=name, slider=True, translate=False)
        row.operator("risorius.mix_remove", text="", icon="X").index = index
        if parent.show_regions:
            column = box.column(align=True)
            for region in REGIONS:
                column.prop(parent, region, slider=True)
    column = layout.column(align=True)
    column.operator("risorius.mix_add", icon="ADD")
    column.operator("risorius.mix_add_scene", icon="USER")
    if len(rows) == 0:
        words.write(
            layout, words.say("The mix needs faces of one topology, such as the sample people.")
        )
        return
    column = layout.column(align=True)
    shown = parents.preview(context) is not None
    column.operator("risorius.mix_preview", icon="HIDE_OFF", depress=shown)
    column.operator("risorius.mix_write", icon="EXPORT")


CLASSES = (RISORIUS_PT_mix, RISORIUS_PT_mix_here)
