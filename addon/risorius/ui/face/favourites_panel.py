# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Favourites above the controls, and entries of a slider's context menu."""

from ... import native
from ...scene.base import parts
from ...scene.character import board, sides
from ..blender_types import Context, Menu, Panel
from ..common import FaceOnlyPanel, active_controls, face_controls, face_rig
from ..hand.favourites import favourites_of
from ..hand.operators import control_under_mouse
from .controls_panel import draw_sliders


class RISORIUS_PT_favourites(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_favourites"
    bl_label = "Favourites"
    bl_order = 0

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and bool(favourites_of(context))

    def draw(self, context: Context) -> None:
        controls, of_slider = face_controls(context), native.regions().of_slider
        face, followers = controls.pose.bones[parts.FACE], sides.followers(controls)
        rig = face_rig(context)
        given = board.given(rig) if board.leads_face(rig) else {}
        names = favourites_of(context)
        for region in dict.fromkeys(map(of_slider, names)):
            own = [name for name in names if of_slider(name) == region]
            draw_sliders(context, self.layout, face, region, own, followers, given)


def draw_button_menu(self: Menu, context: Context) -> None:
    """Add entries to a slider's context menu.

    Args:
        self: the context menu of any button; the menu stays unchanged unless the mouse is over a
            slider of the face.
        context: context of the menu.
    """
    name = control_under_mouse(context) if active_controls(context) is not None else ""
    if not name:
        return
    self.layout.separator()
    self.layout.operator("risorius.favourite", icon="SOLO_ON").controls = name
    for forward, text in ((False, "Key Before"), (True, "Next Key")):
        button = self.layout.operator("risorius.next_key", text=text)
        button.forward, button.control = forward, name


CLASSES = (RISORIUS_PT_favourites,)
