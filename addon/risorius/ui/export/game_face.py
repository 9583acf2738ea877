# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Exports a face as glTF or VRM, with morph targets that other programs drive by name."""

from pathlib import Path

import bpy

from ... import native
from ...scene.base import parts, saved
from ...scene.file import export_dna
from .. import words
from ..blender_types import Context, ExportHelper, Operator, Result
from ..common import FaceOperator, explain, face_rig, proposed_file, system_path
from .licence import LicenceForm


class RISORIUS_OT_export_game_face(LicenceForm, FaceOperator, ExportHelper, Operator):
    """Write the active face as glTF or VRM with morph targets."""

    bl_idname = "risorius.export_game_face"
    bl_label = "Export Game Face"
    bl_description = (
        "Write the active face as glTF whose morph targets other programs drive by name: ARKit, "
        "visemes, VRM"
    )
    bl_options = {"PRESET"}

    filter_glob: bpy.props.StringProperty(default="*.glb;*.vrm", options={"HIDDEN"})
    shapes: bpy.props.EnumProperty(
        name="Shapes",
        items=(
            ("arkit", "ARKit", "Morph targets for the 52 units of ARKit"),
            ("visemes", "Visemes", "Morph targets for the 15 visemes of Oculus lip sync"),
            ("vrm", "VRM", "Morph targets for the preset expressions of VRM 1.0"),
            ("expressions", "Expressions", "Morph targets for the expressions of Risorius"),
            (
                "all",
                "All Controls",
                "A morph target for each control, with the name of the control",
            ),
        ),
        options={"ENUM_FLAG"},
        default={"arkit", "visemes"},
    )
    lod: bpy.props.IntProperty(name="LOD", description="Level of detail", min=0, max=15)
    megabytes: bpy.props.FloatProperty(
        name="Megabytes",
        description=(
            "Largest size of the file in megabytes; textures, vertices and levels "
            "are reduced until the file fits. 0: no limit"
        ),
        min=0.0,
        max=1000.0,
    )
    use_skeleton: bpy.props.BoolProperty(
        name="Skeleton", description="Include joints for neck, head, jaw and eyes", default=True
    )
    body: bpy.props.EnumProperty(
        name="Body",
        description="Bones to add for a body, without meshes",
        items=(
            ("NONE", "None", "No bones for a body: only the joints of the face"),
            ("minimal", "Minimal", "The bones of a body that VRM requires"),
            (
                "mixamo",
                "Mixamo",
                (
                    "All bones of a body with Mixamo's names, as the program "
                    "TalkingHead requires them"
                ),
            ),
        ),
    )
    body_file: bpy.props.StringProperty(
        name="Body File",
        description=(
            "File (glTF or VRM) of a character with a skeleton, to which the face is "
            "attached; empty: none"
        ),
        subtype="FILE_PATH",
    )
    without: bpy.props.StringProperty(
        name="Leave Out",
        description="Meshes of the body to leave out, such as its head, separated by commas",
    )
    use_springs: bpy.props.BoolProperty(
        name="Springs",
        description="Let long hair swing in programs that play the VRM file",
        default=True,
    )
    use_quantize: bpy.props.BoolProperty(
        name="Quantize",
        description="Store coordinates of vertices in 16 bits; most programs can read such a file",
    )
    use_meshopt: bpy.props.BoolProperty(
        name="Compress",
        description="Compress the file with meshoptimizer; some programs cannot read such a file",
    )
    use_combinations: bpy.props.BoolProperty(
        name="Combinations",
        description=(
            "Add morph targets that correct combinations of other targets, and a "
            "script that drives them in a browser"
        ),
    )

    @property
    def filename_ext(self) -> str:
        """The extension that Blender appends to the file's name."""
        return ".glb" if self.vrm == "NONE" else ".vrm"

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            self.filepath = proposed_file(face_rig(context).name, self.filename_ext)
        return ExportHelper.invoke(self, context, event)

    def draw(self, context: Context) -> None:
        del context
        layout = self.layout
        layout.use_property_split = True
        column = layout.column(heading="Shapes")
        column.use_property_split = False
        column.prop(self, "shapes")
        made_up = ("without",) if self.body_file else ("body",)
        for name in ("lod", "megabytes", "body_file", *made_up, "vrm"):
            layout.prop(self, name)
        if self.vrm != "NONE":
            self.draw_licence(layout)
            layout.prop(self, "use_springs")
        for name in ("use_skeleton", "use_quantize", "use_meshopt", "use_combinations"):
            layout.prop(self, name)

    def execute(self, context: Context) -> Result:
        fileio, gameface = native.part("files.fileio"), native.part("gameface")
        self.filepath = system_path(self.filepath)
        if self.vrm != "NONE":
            self.filepath = str(Path(self.filepath).with_suffix(".vrm"))
        out = Path(self.filepath)
        try:
            fileio.check_writable(self.filepath)
            rig = face_rig(context)
            content, _ = export_dna.export(context, rig)
            dna = native.module().load(content)
            source = Path(bpy.path.abspath(saved.text(rig, parts.SOURCE)))
            wishes = gameface.Wishes(
                tuple(name for name in gameface.GROUPS if name in self.shapes),
                self.lod,
                self.use_skeleton,
                quantize=self.use_quantize,
                meshopt=self.use_meshopt,
                mb=self.megabytes or None,
                within=0.5 if self.use_combinations else None,
                humanoid="" if self.body == "NONE" or self.body_file else self.body,
                vrm="" if self.vrm == "NONE" else self.vrm,
                licence={} if self.vrm == "NONE" else self.licence(),
                body=Path(system_path(self.body_file)) if self.body_file else None,
                without=[name.strip() for name in self.without.split(",") if name.strip()],
                springs=self.use_springs,
            )
            made = gameface.export(dna, native.module().Rig(dna), source, out.name, wishes)
            fileio.write_all({out.with_name(name): data for name, data in made.files.items()})
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        for note in made.notes:
            self.report({"WARNING"}, words.local(note))
        count = len(made.files[out.name])
        self.report({"INFO"}, words.say("{name}: {count:,} bytes", name=out.name, count=count))
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_export_game_face,)
