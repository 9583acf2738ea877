# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators for the capture range of a face: learn, load, save, remove."""

from pathlib import Path

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...scene.animation import range_properties
from ...scene.character import runtime
from ...scene.live import range_learning, sessions
from ..blender_types import Context, ExportHelper, ImportHelper, Operator, Result
from ..common import FaceOperator, active_controls, explain, face_controls, face_rig, system_path
from ..words import of_error, say


class _Learns(FaceOperator):
    """Base of operators that learn the capture range of a person and store it with a face."""

    baked_too = True

    most_gain: bpy.props.FloatProperty(
        name="Most Gain",
        description=(
            "Largest factor of a control; a control that needs a larger factor stays "
            "as captured. The limit for lids is at least 2"
        ),
        default=1.6,
        min=1.0,
        max=4.0,
    )

    def keep(self, context: Context, clip: "native.Clip", performance: bool) -> None:
        """Learn a capture range from a captured clip and store the range with the active face.

        Args:
            context: context with the face.
            clip: clip of raw controls.
            performance: True: the clip shows acting, which need not contain all extremes; False:
                the clip shows one extreme after another.

        Raises:
            risorius.RisoriusError: no range can be learned from the clip.
        """
        found = native.part("ranges").learn(clip, performance=performance, most_gain=self.most_gain)
        range_properties.keep(face_controls(context), found)
        used = len(found.used())
        self.report(
            {"INFO"},
            say(
                "{used} controls are stretched, {left} stay as captured.",
                used=used,
                left=len(found.controls) - used,
            ),
        )


class RISORIUS_OT_learn_range(_Learns, Operator, ImportHelper):
    """Learn the range of each control from a capture of a person, so that blinks close the eyes"""

    bl_idname = "risorius.learn_range"
    bl_label = "Learn Range"

    filter_glob: bpy.props.StringProperty(default="*.csv;*.json;*.rzc", options={"HIDDEN"})
    performance: bpy.props.BoolProperty(
        name="Performance",
        description=(
            "The take shows acting: only blinks, and peaks that repeatedly stop at "
            "the same height, count as extremes. Off: the take goes to all extremes "
            "one after another"
        ),
    )

    def execute(self, context: Context) -> Result:
        path = system_path(self.filepath)
        try:
            self.keep(context, self._clip(context, path), self.performance)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(path, error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _clip(self, context: Context, path: str) -> "native.Clip":
        if Path(path).suffix.lower() == ".rzc":
            return native.module().Clip.load(path)
        live = runtime.there(face_rig(context))
        clip, _ = native.part("importing").import_file(
            path, live.dna.raw_control_names, rig=live.rig, rotations="none"
        )
        return clip


class RISORIUS_OT_learn_range_live(_Learns, Operator):
    """Learn the range from the last seconds of live capture"""

    bl_idname = "risorius.learn_range_live"
    bl_label = "Learn from Live"

    seconds: bpy.props.FloatProperty(
        name="Seconds",
        description="Length of the live capture to learn from, in seconds",
        default=30.0,
        min=2.0,
        max=60.0,
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if sessions.of(active_controls(context)) is None:
            cls.poll_message_set(say("Start live capture first."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        session = sessions.of(face_controls(context))
        if session is None:
            raise FaceError(told("Start live capture first."))
        try:
            self.keep(context, range_learning.recent_clip(session, self.seconds), False)
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_load_range(FaceOperator, Operator, ImportHelper):
    """Load the range of a person from a file"""

    bl_idname = "risorius.load_range"
    bl_label = "Load Range"
    baked_too = True

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def execute(self, context: Context) -> Result:
        path = system_path(self.filepath)
        try:
            range_properties.keep(face_controls(context), native.part("ranges").load_ranges(path))
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(path, error))
            return {"CANCELLED"}
        return {"FINISHED"}


class _HasRange(FaceOperator):
    """Base of operators that need a face with a range."""

    baked_too = True

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not range_properties.rows_of(face_controls(context)):
            cls.poll_message_set(say("Learn or load the range of this face first."))
            return False
        return True


class RISORIUS_OT_save_range(_HasRange, Operator, ExportHelper):
    """Write the range of this person to a file, for other faces and the command line"""

    bl_idname = "risorius.save_range"
    bl_label = "Save Range"
    bl_options = {"REGISTER"}

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def execute(self, context: Context) -> Result:
        path = system_path(self.filepath)
        text = native.part("ranges").ranges_text(range_properties.all_of(face_controls(context)))
        try:
            native.part("importing").write_text(text, path)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(path, error))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_forget_range(_HasRange, Operator):
    """Remove the range of this face; captures are then not stretched"""

    bl_idname = "risorius.forget_range"
    bl_label = "Forget Range"

    def execute(self, context: Context) -> Result:
        range_properties.forget(face_controls(context))
        return {"FINISHED"}


CLASSES = (
    RISORIUS_OT_learn_range,
    RISORIUS_OT_learn_range_live,
    RISORIUS_OT_load_range,
    RISORIUS_OT_save_range,
    RISORIUS_OT_forget_range,
)
