# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel By Hand: from key to key, between poses, a tweak over a range."""

from ...scene.animation import tweaks
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_controls


class RISORIUS_PT_hand(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_hand"
    bl_label = "By Hand"
    bl_parent_id = "RISORIUS_PT_animation"  # the sections of the tab are to be seen at once

    def draw(self, context: Context) -> None:
        layout = self.layout
        row = layout.row(align=True)
        row.operator("risorius.next_key", text="Key Before", icon="PREV_KEYFRAME").forward = False
        row.operator("risorius.next_key", text="Next Key", icon="NEXT_KEYFRAME").forward = True
        layout.operator("risorius.breakdown", icon="ARROW_LEFTRIGHT").kind = "BREAKDOWN"
        row = layout.row(align=True)
        row.operator("risorius.breakdown", text="Relax or Push").kind = "NEIGHBOURS"
        row.operator("risorius.breakdown", text="To Rest").kind = "REST"
        _draw_tweak(layout, tweaks.of(face_controls(context)))
        layout.operator("risorius.colour_curves", icon="COLOR")


def _draw_tweak(layout: UILayout, tweak: tweaks.Tweak | None) -> None:
    button = layout.operator("risorius.tweak", icon="MOD_TIME", depress=tweak is not None)
    button.enable = tweak is None
    if tweak is None:
        return
    words.write(
        layout,
        words.say(
            "A tweak is on from frame {first:g} to {last:g}. Move sliders there and press Key: "
            "the change goes into its layer, the keys below stay.",
            first=tweak.first,
            last=tweak.last,
        ),
        "INFO",
    )


CLASSES = (RISORIUS_PT_hand,)
