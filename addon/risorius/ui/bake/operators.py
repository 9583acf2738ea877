# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that bake faces to plain actions, and that remove these actions again."""

import time
import traceback
from collections.abc import Generator

import bpy

from ... import native
from ...scene.bake import bake_face, physics
from ...scene.base import console, parts
from .. import words
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, shown_progress
from .selection import FacesOperator, FrameRange, selected_rigs

_SLICE = 0.05  # seconds of baking between two events


class RISORIUS_OT_bake(FrameRange, FacesOperator, Operator):
    """Write the animation of the selected faces into plain actions; Back to Live undoes this"""

    bl_idname = "risorius.bake"
    bl_label = "Bake Face"

    kind: bpy.props.EnumProperty(
        name="Bake",
        items=(
            (
                bake_face.RESULT,
                "Bones, Shapes, Maps",
                "Actions for bones, shape keys and maps; they move the face without the add-on",
            ),
            (
                bake_face.CONTROLS,
                "Controls",
                "One action for the sliders and control bones; the add-on moves the face",
            ),
        ),
    )
    wanted: bpy.props.EnumProperty(
        name="Parts",
        description="Parts to bake; other parts keep their current state",
        items=(
            (
                "BONES",
                "Bones",
                "Bones of the deforming armature, and the transform of the armature",
            ),
            ("SHAPES", "Shapes", "Shape keys of the meshes"),
            ("MAPS", "Maps", "Values of the animated maps, which materials read"),
        ),
        options={"ENUM_FLAG"},
        default={"BONES", "SHAPES", "MAPS"},
    )
    error: bpy.props.FloatProperty(
        name="Largest Error",
        description=(
            "Remove keys as long as the curve stays within this distance of every baked value, "
            "in the units of each curve; 0 keeps a key at every step"
        ),
        default=0.0,
        min=0.0,
        soft_max=0.01,
        precision=6,
    )
    strip: bpy.props.BoolProperty(
        name="Onto NLA Track", description="Put the actions onto new NLA tracks", default=False
    )
    _interactive = False

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self._interactive = True
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "kind")
        self.draw_range(layout)
        if self.kind == bake_face.RESULT:
            layout.prop(self, "wanted")
            self.draw_lod(layout)
        words.prop_or(layout, self, "error", 0.0, "0: a key at every step")
        layout.prop(self, "strip")
        layout.prop(self, "every")

    def execute(self, context: Context) -> Result:
        # The redo panel runs the same operator object again, and must wait until baking has ended.
        # So the flag is cleared.
        interactive, self._interactive = self._interactive, False
        start, end = self.frames(context)
        options = bake_face.BakeOptions(
            self.kind,
            start,
            end,
            self.step,
            self.lod,
            frozenset(self.wanted),
            self.error,
            self.strip,
        )
        try:
            job = bake_face.bake(context, self.faces(context), options)
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        if interactive and not bpy.app.background:
            return self._begin(context, job)
        return self._run(context, job)

    def _run(self, context: Context, job: Generator[float, None, list[str]]) -> Result:
        """Bake and wait for the end, in scripts and in background mode."""
        with shown_progress(context):
            while not self._step(context, job, seconds=1.0):
                if bpy.app.background:
                    console.say(f"baking, {self._share:.0%}")
        return self._result

    def _begin(self, context: Context, job: Generator[float, None, list[str]]) -> Result:
        manager = context.window_manager
        self._job = job
        self._timer = manager.event_timer_add(0.01, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        if event.type == "ESC":
            self._job.close()
            self.report({"INFO"}, words.say("Baking was cancelled; nothing was changed."))
            self._result = {"CANCELLED"}
        elif event.type != "TIMER" or not self._step(context, self._job, _SLICE):
            return {"RUNNING_MODAL"}
        self._end(context)
        return self._result

    def cancel(self, context: Context) -> None:
        """Stop baking; Blender calls this when the window closes or another file is opened."""
        self._job.close()
        self._end(context)

    def _end(self, context: Context) -> None:
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()

    def _step(
        self, context: Context, job: Generator[float, None, list[str]], seconds: float
    ) -> bool:
        """Bake for a number of seconds. Returns whether baking has ended, also by an error, which
        is reported; self._result is then the operator's result."""
        end = time.monotonic() + seconds
        self._result: Result = {"FINISHED"}
        try:
            self._share = next(job)
            while time.monotonic() < end:
                self._share = next(job)
        except StopIteration as finished:
            for sentence in finished.value or ():
                self.report({"INFO"}, sentence)
            return True
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            self._result = {"CANCELLED"}
            return True
        except Exception as error:  # noqa: BLE001  a modal operator that raises would never end
            traceback.print_exc()
            self.report(
                {"ERROR"},
                words.say("Baking failed; the faces were not changed: {error}.", error=repr(error)),
            )
            self._result = {"CANCELLED"}
            return True
        context.window_manager.progress_update(self._share * 100)
        return False


class RISORIUS_OT_unbake(FacesOperator, Operator):
    """Let the controls move the selected faces again."""

    bl_idname = "risorius.unbake"
    bl_label = "Back to Live"
    bl_description = (
        "Let the controls move the selected faces again. Baked actions are removed, except "
        "actions that you edited, gave a fake user, or use elsewhere"
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        there = (*selected_rigs(context), *selected_rigs(context, every=True))
        if not any(bake_face.baked(rig) for rig in there):
            cls.poll_message_set(words.say("No face is baked."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        faces = selected_rigs(context, self.every)
        back = [rig for rig in faces if bake_face.unbake(context, rig)]
        if not back:
            self.report({"WARNING"}, words.say("None of the selected faces is baked."))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_bake_physics(FaceOperator, Operator):
    """Bake all simulations of the scene; they see each face at their own frame"""

    bl_idname = "risorius.bake_physics"
    bl_label = "Bake Physics"
    bl_options = {"REGISTER"}
    baked_too = True

    def execute(self, context: Context) -> Result:
        faces = [r for r in selected_rigs(context, every=True) if parts.BAKED not in r]
        try:
            self.report({"INFO"}, words.say(physics.bake(context, faces)))
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_bake, RISORIUS_OT_unbake, RISORIUS_OT_bake_physics)
