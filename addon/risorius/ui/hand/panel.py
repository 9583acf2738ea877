# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel By Hand: next key, breakdown poses, tweaks over a range of frames."""

from ...scene.animation import tweaks
from ..blender_types import Context, Panel
from ..common import FaceOnlyPanel, face_controls


class RISORIUS_PT_hand(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_hand"
    bl_label = "By Hand"
    bl_parent_id = "RISORIUS_PT_animation"  # a subpanel saves room in the tab

    def draw(self, context: Context) -> None:
        layout = self.layout
        row = layout.row(align=True)
        row.operator("risorius.next_key", text="Key Before", icon="PREV_KEYFRAME").forward = False
        row.operator("risorius.next_key", text="Next Key", icon="NEXT_KEYFRAME").forward = True
        layout.operator("risorius.breakdown", icon="ARROW_LEFTRIGHT").kind = "BREAKDOWN"
        row = layout.row(align=True)
        row.operator("risorius.breakdown", text="Relax or Push").kind = "NEIGHBOURS"
        row.operator("risorius.breakdown", text="To Rest").kind = "REST"
        on = tweaks.of(face_controls(context)) is not None
        layout.operator("risorius.tweak", icon="MOD_TIME", depress=on).enable = not on
        layout.operator("risorius.colour_curves", icon="COLOR")


CLASSES = (RISORIUS_PT_hand,)
