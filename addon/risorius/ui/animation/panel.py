# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel for importing animation, with the report of the last import."""

from ...scene.animation import speech_task
from .. import words
from ..blender_types import Context, Panel
from ..common import FaceOnlyPanel, face_controls
from ..expressions.menus import RISORIUS_MT_expressions
from .mesh_operators import RISORIUS_OT_curves_from_mesh
from .operators import RISORIUS_OT_import_animation, RISORIUS_OT_import_arkit_rig
from .place_clip import report_of


class RISORIUS_PT_animation(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_animation"
    bl_label = "Animation"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        column = layout.column(align=True)
        column.operator_context = "INVOKE_DEFAULT"
        column.operator(RISORIUS_OT_import_animation.bl_idname, icon="IMPORT")
        column.operator(RISORIUS_OT_import_arkit_rig.bl_idname, icon="SHAPEKEY_DATA")
        column.operator(RISORIUS_OT_curves_from_mesh.bl_idname, icon="MESH_DATA")
        column.operator("risorius.learn_range", icon="DRIVER_DISTANCE")
        row = column.row(align=True)
        row.operator("risorius.speak", icon="SPEAKER")
        if speech_task.lacks_recogniser():  # a click on Speak shows the reason
            row.operator("risorius.install_speech", text="", icon="ERROR")
        column.menu(RISORIUS_MT_expressions.bl_idname, icon="USER")
        data = face_controls(context).animation_data
        action = data.action if data is not None else None
        lines = report_of(action)
        if action is None or not lines:
            return
        header, body = layout.panel("RISORIUS_PT_import_report", default_closed=True)
        words.show(header, words.say("Import of {action}", action=action.name))
        if body is not None:
            body.operator("risorius.rest_others", icon="LOOP_BACK")
            for line in lines:
                words.write(body, line)


CLASSES = (RISORIUS_PT_animation,)
