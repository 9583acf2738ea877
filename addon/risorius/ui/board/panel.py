# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Face Board in Options, and the buttons Sliders and Board in the panel Controls."""

from ...scene.base.blender_types import ArmatureObject
from ...scene.character import board, runtime
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_controls, face_rig
from .operators import LEADERS


def draw_lead(layout: UILayout, controls: ArmatureObject, live: runtime.Runtime) -> bool:
    """Draw the choice between sliders and board, if the face has a board.

    Args:
        layout: layout of the panel.
        controls: control armature of the face.
        live: Runtime of the face.

    Returns:
        Whether the board moves the face; False without a board.
    """
    if not board.is_there(controls, live):
        return False
    led = board.leads(controls, live)
    row = layout.row(align=True)
    for by, text, _tip in LEADERS:
        row.operator("risorius.lead", text=text, depress=led == (by == "BOARD")).by = by
    return led


def draw_kinds(layout: UILayout, kind: str | None) -> None:
    """Draw buttons that add a board, or replace the existing board by a board of another kind.

    Args:
        layout: layout of the panel or menu.
        kind: kind of the existing board, or None.
    """
    if kind is None:
        button = layout.operator("risorius.add_board", icon="ADD")
        button.kind = runtime.PRIMARY
    for other, text in ((runtime.PRIMARY, "Primary Board"), (runtime.COMPLETE, "Complete Board")):
        if other != (kind or runtime.PRIMARY):
            layout.operator("risorius.add_board", text=text, icon="MESH_GRID").kind = other


class RISORIUS_PT_board(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_board"
    bl_label = "Face Board"
    bl_parent_id = "RISORIUS_PT_options"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        controls, live = face_controls(context), runtime.of(face_rig(context))
        if live is None:
            return
        if not board.is_there(controls, live):
            draw_kinds(layout, None)
            return
        led = draw_lead(layout, controls, live)
        gone = board.missing(controls, live)
        if gone:
            words.write(
                layout, words.say("{count} handles of the board are missing.", count=len(gone))
            )
            back = layout.operator("risorius.add_board", text="Bring Back", icon="LOOP_BACK")
            back.kind = live.board
        if led:
            row = layout.row(align=True)
            button = row.operator("risorius.reset_board", text="Reset Selected", icon="LOOP_BACK")
            button.selected = True
            row.operator("risorius.reset_board", text="Reset All").selected = False
        layout.operator_menu_enum("risorius.select_board", "region", icon="RESTRICT_SELECT_OFF")
        layout.operator("risorius.frame_board", icon="ZOOM_SELECTED")
        draw_kinds(layout, live.board)
        layout.operator("risorius.remove_board", icon="TRASH")


CLASSES = (RISORIUS_PT_board,)
