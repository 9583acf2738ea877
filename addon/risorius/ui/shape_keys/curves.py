# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Assigns unknown curves of an imported file to controls, and saves the mapping."""

from __future__ import annotations

from typing import Any, cast

import bpy

from ... import native
from ...scene.shape_keys import assigned, pictures, unknown_curves
from .. import words
from ..blender_types import Context, ExportHelper, Operator, Panel, Result
from ..common import (
    FaceOnlyPanel,
    FaceOperator,
    active_controls,
    explain,
    face_controls,
    proposed_file,
    system_path,
)
from ..expressions import previews
from . import shown
from .operators import choice_items, fill_choices

_MOST = 40  # largest number of drawn lines


class _OfCurves(FaceOperator):
    """Base of operators on the curves of the last import whose names no mapping contains."""

    baked_too = True

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Whether the face has unknown curves of its last import; if not, set the poll message."""
        if not super().poll(context):
            return False
        if unknown_curves.of(face_controls(context)) is None:
            cls.poll_message_set(words.say("The last import has no curves with unknown names."))
            return False
        return True


class RISORIUS_OT_assign_curve(_OfCurves, Operator):
    """Assign a control or expression to a curve of the imported file; empty: ignore the curve"""

    bl_idname = "risorius.assign_curve"
    bl_label = "Assign Curve"

    curve: bpy.props.StringProperty(name="Curve", options={"SKIP_SAVE"})
    becomes: bpy.props.StringProperty(
        name="Control or Expression",
        description="A control, such as jawOpen; =mouthFunnel: an ARKit unit; @joy: an expression",
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        if self.becomes and self.becomes not in {c.value for c in assigned.choices()}:
            self.report({"ERROR"}, words.say("A control or an expression was expected."))
            return {"CANCELLED"}
        unknown_curves.put(face_controls(context), self.curve, self.becomes)
        return {"FINISHED"}


class RISORIUS_OT_choose_curve(_OfCurves, Operator):
    """Find a control or expression to assign to a curve of the imported file"""

    bl_idname = "risorius.choose_curve"
    bl_label = "Choose a Control for a Curve"
    bl_property = "choice"

    curve: bpy.props.StringProperty(name="Curve", options={"SKIP_SAVE"})
    choice: bpy.props.EnumProperty(name="Becomes", items=choice_items, options={"SKIP_SAVE"})

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        fill_choices()
        context.window_manager.invoke_search_popup(cast(Any, self))
        return {"FINISHED"}

    def execute(self, context: Context) -> Result:
        unknown_curves.put(face_controls(context), self.curve, self.choice)
        return {"FINISHED"}


class RISORIUS_OT_save_curve_mapping(_OfCurves, Operator, ExportHelper):
    """Save your assignments as a mapping and import the file again with it"""

    bl_idname = "risorius.save_curve_mapping"
    bl_label = "Save Mapping"

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})
    use_import: bpy.props.BoolProperty(
        name="Import Again", description="Import the file again with the new mapping", default=True
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            self.filepath = proposed_file("mapping", ".toml")
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        found = unknown_curves.of(face_controls(context))
        self.filepath = system_path(self.filepath)
        if found is None:
            return {"CANCELLED"}
        try:
            text = unknown_curves.mapping_text(found)
            native.part("files.fileio").write_text(self.filepath, text)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        if not self.use_import:
            return {"FINISHED"}
        settings = {**found.settings, "mapping": "FILE", "mapping_file": self.filepath}
        try:
            done: Result = cast(Any, bpy.ops).risorius.import_animation(**settings)
        except (RuntimeError, TypeError) as error:  # Blender raises its error reports
            self.report({"ERROR"}, str(error).removeprefix("Error: ").strip())
            return {"CANCELLED"}
        return done


class RISORIUS_PT_curve_names(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_curve_names"
    bl_label = "Unknown Curves"
    bl_parent_id = "RISORIUS_PT_animation"

    @classmethod
    def poll(cls, context: Context) -> bool:
        controls = active_controls(context)
        return controls is not None and unknown_curves.of(controls) is not None

    def draw(self, context: Context) -> None:
        layout = self.layout
        found = unknown_curves.of(face_controls(context))
        if found is None:
            return
        column = layout.column(align=True)
        for name in found.names[:_MOST]:
            value = found.said.get(name)
            split = column.split(factor=0.42, align=True)
            icon = previews.icon_of(pictures.sample_path(value)) if value else 0
            if icon:
                split.label(text=name, icon_value=icon, translate=False)
            else:
                words.show(split, name, "QUESTION" if value is None else "BLANK1")
            row = split.row(align=True)
            text = words.say("Choose...") if value is None else shown.words_of_value(value)
            button = row.operator("risorius.choose_curve", text=text, translate=False)
            button.curve = name
            button = row.operator("risorius.assign_curve", text="", icon="X")
            button.curve = name
        if len(found.names) > _MOST:
            words.show(layout, words.say("and {count} more", count=len(found.names) - _MOST))
        column = layout.column()
        column.enabled = bool(found.said)
        column.operator("risorius.save_curve_mapping", icon="EXPORT")


CLASSES = (
    RISORIUS_OT_assign_curve,
    RISORIUS_OT_choose_curve,
    RISORIUS_OT_save_curve_mapping,
    RISORIUS_PT_curve_names,
)
