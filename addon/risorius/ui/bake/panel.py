# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Bake and Export, and the panel Face's warnings about faces that follow a frame late."""

from ...scene.bake import bake_face
from ...scene.base.blender_types import ArmatureObject
from ...scene.frame import hindrances, joint_readings, lateness
from ...scene.skinning import caches
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_rig
from .operators import RISORIUS_OT_unbake


class RISORIUS_PT_out(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_out"
    bl_label = "Bake and Export"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        column = self.layout.column(align=True)
        text = bake_face.words(face_rig(context))
        if text:
            words.write(column, text, "ACTION")
            column.operator(RISORIUS_OT_unbake.bl_idname, icon="LOOP_BACK")
        # The buttons open dialogs with the settings of the last use.
        column.operator_context = "INVOKE_DEFAULT"
        column.operator("risorius.bake", icon="ACTION")
        column.operator("risorius.export_animation", icon="EXPORT")
        column.operator("risorius.bake_physics", icon="PHYSICS")
        column.operator("risorius.export_web", icon="URL")
        column.operator("risorius.export_game_face", icon="SHAPEKEY_DATA")


def draw_late(layout: UILayout, rig: ArmatureObject) -> None:
    """Draw warnings about a face that is evaluated a frame late, does not follow its controls, or
    has simulations that an older version baked a frame late.

    Args:
        layout: layout of the panel.
        rig: deforming armature.
    """
    caches.look()
    said = (
        lateness.words(rig),
        joint_readings.words(rig),
        caches.words(rig),
        *hindrances.words(rig),
    )
    for late in filter(None, said):
        words.write(layout, late, "ERROR")


CLASSES = (RISORIUS_PT_out,)
