# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Exports a face as a web page."""

from pathlib import Path

import bpy

from ... import native
from ...scene.animation.clip_actions import frame_rate
from ...scene.base.blender_types import ArmatureObject
from ...scene.export import export_animation, web_page
from ...scene.file import export_dna
from .. import words
from ..bake.selection import FrameRange
from ..blender_types import Context, ExportHelper, Operator, Result
from ..common import FaceOperator, explain, face_rig, proposed_file, system_path
from .operators import run


class RISORIUS_OT_export_web(FrameRange, FaceOperator, ExportHelper, Operator):
    """Write the active face as a web page."""

    bl_idname = "risorius.export_web"
    bl_label = "Export Web Page"
    bl_description = (
        "Write the active face as one page that opens in any browser, without a network: with "
        "sliders, levels of detail and its animation"
    )
    bl_options = {"PRESET"}

    filename_ext = ".html"
    filter_glob: bpy.props.StringProperty(default="*.html", options={"HIDDEN"})
    use_animation: bpy.props.BoolProperty(
        name="Animation", description="Include the animation of the controls", default=True
    )
    use_sound: bpy.props.BoolProperty(
        name="Sound",
        description="Include the first sound strip",
        default=True,
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            self.filepath = proposed_file(face_rig(context).name, ".html")
        return ExportHelper.invoke(self, context, event)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "use_animation")
        if self.use_animation:
            layout.prop(self, "use_sound")
            self.draw_range(layout)

    def execute(self, context: Context) -> Result:
        fileio = native.part("files.fileio")
        self.filepath = system_path(self.filepath)
        try:
            fileio.check_writable(self.filepath)
            rig = face_rig(context)
            content, _ = export_dna.export(context, rig)
            clip, sound = self._take(context, rig) if self.use_animation else (None, None)
            page = web_page.page(rig, content, clip, sound)
            fileio.write_bytes(self.filepath, page)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        self.report(
            {"INFO"},
            words.say("{name}: {count:,} bytes", name=Path(self.filepath).name, count=len(page)),
        )
        return {"FINISHED"}

    def _take(
        self, context: Context, rig: ArmatureObject
    ) -> "tuple[native.Clip, web_page.Sound | None]":
        start, end = self.frames(context)
        rate = frame_rate(context.scene)
        options = export_animation.ShipOptions(start, end, self.step)
        taken = run(context, export_animation.sampled(context, [rig], options))
        clip = export_animation.clip(*taken[0], rate, start)
        sound = web_page.first_sound(context.scene, start, end, rate) if self.use_sound else None
        return clip, sound


CLASSES = (RISORIUS_OT_export_web,)
