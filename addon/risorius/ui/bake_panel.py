# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that takes a face's animation out of the add-on."""

import bpy

from .panels import FaceOnlyPanel


class RISORIUS_PT_out(FaceOnlyPanel, bpy.types.Panel):
    bl_idname = "RISORIUS_PT_out"
    bl_label = "Bake and Export"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, _context):
        column = self.layout.column(align=True)
        # A dialog for each; the defaults are those of the last time.
        column.operator_context = "INVOKE_DEFAULT"
        column.operator("risorius.bake", icon="ACTION")
        column.operator("risorius.export_animation", icon="EXPORT")


CLASSES = (RISORIUS_PT_out,)
