# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators between a face and its file: replace it, read it again."""

from pathlib import Path

import bpy
from bpy_extras.io_utils import ImportHelper

from .. import native
from ..logic.plans import PlanError
from ..logic.space import SpaceError
from ..scene import evaluate, parts, replace
from .import_operators import explain, shown_progress, usable


def has_face(cls, context):
    """Poll: whether there is a face; says why when there is not."""
    if not usable(cls):
        return False
    if parts.active_rig(context) is None:
        cls.poll_message_set("Select a face first.")
        return False
    return True


def report_all(operator, sentences, shown=8):
    """Report sentences, the last of many as a number."""
    for sentence in sentences[:shown]:
        operator.report({"INFO"}, sentence)
    if len(sentences) > shown:
        operator.report({"INFO"}, f"and {len(sentences) - shown} more: see the report's text")


def _replace(operator, context, path):
    rig = parts.active_rig(context)
    try:
        with shown_progress(context) as progress:
            sentences = replace.replace_file(context, rig, path, progress)
    except replace.ReplaceError as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    except (native.dna_error(), PlanError, SpaceError, OSError) as error:
        operator.report({"ERROR"}, explain(path, error))
        return {"CANCELLED"}
    evaluate.evaluate(rig, context.evaluated_depsgraph_get(), force=True)
    context.view_layer.update()
    report_all(operator, sentences)
    operator.report({"INFO"}, f"{rig.name.removesuffix('_rig')} is now {Path(path).name}")
    return {"FINISHED"}


class RISORIUS_OT_replace_dna(bpy.types.Operator, ImportHelper):
    """Let another DNA file take this face's place; keys, edits and materials stay"""

    bl_idname = "risorius.replace_dna"
    bl_label = "Replace DNA"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return has_face(cls, context)

    def execute(self, context):
        return _replace(self, context, self.filepath)


class RISORIUS_OT_reload(bpy.types.Operator):
    """Read the face's file again; asks for it where it is no longer in its place"""

    bl_idname = "risorius.reload"
    bl_label = "Reload from Source"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return has_face(cls, context)

    @staticmethod
    def _path(context):
        return bpy.path.abspath(parts.active_rig(context).get(parts.SOURCE, ""))

    def invoke(self, context, _event):
        path = self._path(context)
        if not path or not Path(path).is_file():
            return bpy.ops.risorius.replace_dna("INVOKE_DEFAULT")
        return self.execute(context)

    def execute(self, context):
        path = self._path(context)
        if not path or not Path(path).is_file():
            name = Path(path).name or "of this face"
            self.report(
                {"ERROR"}, f"The file {name} is not in its place any more: use Replace DNA."
            )
            return {"CANCELLED"}
        return _replace(self, context, path)


CLASSES = (RISORIUS_OT_replace_dna, RISORIUS_OT_reload)
