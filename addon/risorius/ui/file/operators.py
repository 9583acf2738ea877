# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that replace, reload and export the DNA file of a face."""

from collections.abc import Sequence
from pathlib import Path

import bpy

from ... import native
from ...scene.base import parts, saved
from ...scene.file import export_dna, replace_dna
from ...scene.frame import evaluate
from ..blender_types import Context, ExportHelper, ImportHelper, Menu, Operator, Result
from ..common import (
    FaceOperator,
    explain,
    face_rig,
    proposed_file,
    shown_progress,
    system_path,
)
from ..words import local, of_error, say


def report_all(operator: Operator, sentences: Sequence[str], shown: int = 8) -> None:
    """Report the first `shown` sentences, and the number of the sentences that follow them.

    Args:
        operator: operator that reports.
        sentences: the sentences, in the order of the report.
        shown: largest number of sentences to report.
    """
    for sentence in sentences[:shown]:
        operator.report({"INFO"}, local(sentence))
    if len(sentences) > shown:
        operator.report(
            {"INFO"}, say("and {count} more: see the report's text", count=len(sentences) - shown)
        )


def _replace(operator: Operator, context: Context, path: str) -> Result:
    rig = face_rig(context)
    try:
        with shown_progress(context) as progress:
            sentences = replace_dna.replace_file(context, rig, path, progress)
    except replace_dna.ReplaceError as error:
        operator.report({"ERROR"}, of_error(error))
        return {"CANCELLED"}
    except native.user_errors() as error:
        operator.report({"ERROR"}, explain(path, error))
        return {"CANCELLED"}
    evaluate.bring_up(context, rig)
    report_all(operator, sentences)
    operator.report(
        {"INFO"},
        say(
            "{face} now uses the DNA of {file}",
            face=rig.name.removesuffix("_rig"),
            file=Path(path).name,
        ),
    )
    return {"FINISHED"}


class _FileOperator(FaceOperator):
    """Base of operators that accept a face without its control armature or its DNA data."""

    whole_face = False


class RISORIUS_OT_replace_dna(_FileOperator, Operator, ImportHelper):
    """Replace the DNA file of this face; keys, edits and materials stay"""

    bl_idname = "risorius.replace_dna"
    bl_label = "Replace DNA"

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})

    def execute(self, context: Context) -> Result:
        return _replace(self, context, system_path(self.filepath))


class RISORIUS_OT_reload(_FileOperator, Operator):
    """Read the DNA file of the face again; opens a file browser if the file is missing"""

    bl_idname = "risorius.reload"
    bl_label = "Reload from Source"

    @staticmethod
    def _path(context: Context) -> str:
        return bpy.path.abspath(saved.text(face_rig(context), parts.SOURCE))

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        path = self._path(context)
        if not path or not Path(path).is_file():
            bpy.ops.risorius.replace_dna("INVOKE_DEFAULT")  # pyright: ignore  made by registration
            return {"CANCELLED"}  # the file selector runs the other operator
        return self.execute(context)

    def execute(self, context: Context) -> Result:
        path = self._path(context)
        if not path or not Path(path).is_file():
            name = Path(path).name or "of this face"
            self.report(
                {"ERROR"},
                say("The file {name} is not in its place any more: use Replace DNA.", name=name),
            )
            return {"CANCELLED"}
        return _replace(self, context, path)


class RISORIUS_OT_export_dna(_FileOperator, Operator, ExportHelper):
    """Write this face's DNA file, with the edits."""

    bl_idname = "risorius.export_dna"
    bl_label = "Export DNA"
    bl_description = (
        "Write this face's DNA file: unchanged since the import, except for your "
        "edits of shape keys, neutral vertices, joints and weights"
    )
    bl_options = {"PRESET"}

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})
    use_shapes: bpy.props.BoolProperty(
        name="Shape Keys",
        description=(
            "Write edited shape keys that come from the DNA file; "
            "shape keys that you added are never written"
        ),
        default=True,
    )
    use_neutral: bpy.props.BoolProperty(
        name="Neutral Mesh",
        description="Write vertices that were moved in the shape key Basis",
        default=True,
    )
    use_joints: bpy.props.BoolProperty(
        name="Neutral Joints",
        description="Write joints moved or turned in the rig's edit mode",
        default=True,
    )
    use_weights: bpy.props.BoolProperty(
        name="Weights", description="Write painted skin weights", default=True
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            self.filepath = proposed_file(face_rig(context).name, ".dna")
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        self.filepath = system_path(self.filepath)
        options = export_dna.ExportOptions(
            self.use_shapes, self.use_neutral, self.use_joints, self.use_weights
        )
        fileio = native.part("files.fileio")
        try:
            fileio.check_writable(self.filepath)
            content, sentences = export_dna.export(context, rig, options)
            fileio.write_bytes(self.filepath, content)
        except export_dna.ExportError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        report_all(self, sentences)
        self.report(
            {"INFO"},
            say("{name}: {count:,} bytes", name=Path(self.filepath).name, count=len(content)),
        )
        return {"FINISHED"}


def draw_export(self: Menu, _context: Context) -> None:
    """Add the entries for faces to the menu File > Export."""
    self.layout.operator(RISORIUS_OT_export_dna.bl_idname, text="MetaHuman DNA (.dna)")
    # This menu also contains Blender's own exporters, which write a face in its rest pose unless
    # the face is baked. So the menu gets entries for the animation of faces, too.
    self.layout.operator(
        "risorius.export_animation", text="Face Animation (.glb, .fbx, .usd, .abc)"
    )
    self.layout.operator("risorius.export_game_face", text="Game Face (.glb, .vrm)")


CLASSES = (RISORIUS_OT_replace_dna, RISORIUS_OT_reload, RISORIUS_OT_export_dna)
