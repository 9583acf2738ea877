# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators of live capture: start, stop, record, neutral face, subject."""

from collections.abc import Callable

import bpy

from ... import native
from ...logic.base import names
from ...logic.base.errors import FaceError
from ...scene.animation import clip_actions, tweaks
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import board
from ...scene.live import capture, recordings, sessions
from ..blender_types import Context, Operator, OperatorBase, Result
from ..common import active_controls, face_rig, usable
from ..words import of_error, say
from .properties import choices, settings_of

_NOT_STARTED = "Start live capture first."


class _Running(OperatorBase):
    """Base of operators that need a running capture of the active face."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls):
            return False
        if sessions.of(active_controls(context)) is None:
            cls.poll_message_set(say(_NOT_STARTED))
            return False
        return True


def _has_controls(cls: type[Operator], context: Context) -> bool:
    """Poll: whether a face is active; if not, set the poll message."""
    if active_controls(context) is None:
        cls.poll_message_set(say("Select a face first."))
        return False
    return True


class RISORIUS_OT_live_start(Operator):
    """Let the active face follow a capture app until you stop live capture"""

    bl_idname = "risorius.live_start"
    bl_label = "Start"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls) or not _has_controls(cls, context):
            return False
        if board.leads_face(face_rig(context)):
            cls.poll_message_set(
                say("The board leads this face: choose Sliders in the panel Controls first.")
            )
            return False
        return True

    def execute(self, context: Context) -> Result:
        if tweaks.of(parts.controls_there(face_rig(context))) is not None:
            self.report({"ERROR"}, say("A tweak is on: choose Done at the top of the tab first."))
            return {"CANCELLED"}
        try:
            capture.start(face_rig(context), settings_of(context))
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        return {"FINISHED"}


def _session(context: Context) -> sessions.Session:
    """The running capture of the active face.

    Raises:
        FaceError: no capture of the active face is running.
    """
    session = sessions.of(active_controls(context))
    if session is None:
        raise FaceError(_NOT_STARTED)
    return session


class RISORIUS_OT_live_stop(_Running, Operator):
    """Stop live capture, and finish a recording; the sliders return to their earlier values"""

    bl_idname = "risorius.live_stop"
    bl_label = "Stop"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Context) -> Result:
        session = _session(context)
        if session.recording is not None:
            _finish(self, context, lambda *where: capture.finish_take(session, *where))
        capture.stop(active_controls(context))
        return {"FINISHED"}


class RISORIUS_OT_live_record(_Running, Operator):
    """Begin a recording at the current frame, or end it and make it an action of the face"""

    bl_idname = "risorius.live_record"
    bl_label = "Record"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Context) -> Result:
        session = _session(context)
        if session.recording is None:
            capture.begin_take(session, float(context.scene.frame_current))
            return {"FINISHED"}
        done = _finish(self, context, lambda *where: capture.finish_take(session, *where))
        return {"FINISHED"} if done else {"CANCELLED"}


class _Waiting(OperatorBase):
    """Base of operators on a recording that is not an action yet."""

    index: bpy.props.IntProperty(
        name="Recording", description="Number of the waiting recording", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls):
            return False
        if not recordings.waiting():
            cls.poll_message_set(say("No recording waits to be finished."))
            return False
        return True

    def recording(self) -> recordings.Recording | None:
        """The recording with the number `index`, or None after an error report."""
        found = recordings.waiting()
        if not 0 <= self.index < len(found):
            self.report(
                {"ERROR"},
                say(
                    "There is no recording {number}: {count} wait to be finished.",
                    number=self.index,
                    count=len(found),
                ),
            )
            return None
        return found[self.index]


class RISORIUS_OT_live_finish(_Waiting, Operator):
    """Make a waiting recording an action of the active face"""

    bl_idname = "risorius.live_finish"
    bl_label = "Finish"
    bl_options = {"REGISTER", "UNDO"}

    at_current: bpy.props.BoolProperty(
        name="At Current Frame",
        description="Begin at the current frame instead of the first frame of the recording",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and _has_controls(cls, context)

    def execute(self, context: Context) -> Result:
        recording = self.recording()
        if recording is None:
            return {"CANCELLED"}
        if self.at_current:
            recording.frame = float(context.scene.frame_current)
        done = _finish(self, context, lambda *where: recordings.finish(recording, *where))
        return {"FINISHED"} if done else {"CANCELLED"}


class RISORIUS_OT_live_discard(_Waiting, Operator):
    """Delete a waiting recording; this cannot be undone"""

    bl_idname = "risorius.live_discard"
    bl_label = "Throw Away"

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: Context) -> Result:
        recording = self.recording()
        if recording is None:
            return {"CANCELLED"}
        recordings.discard(recording)
        return {"FINISHED"}


class RISORIUS_OT_live_neutral(_Running, Operator):
    """Use the current face as the neutral face, which is subtracted from received faces"""

    bl_idname = "risorius.live_neutral"
    bl_label = "Neutral Now"

    forget: bpy.props.BoolProperty(
        name="Forget",
        description="Forget the neutral face: received faces are used unchanged",
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        session = _session(context)
        if self.forget:
            sessions.forget_neutral(session)
        elif not sessions.neutral_now(session):
            self.report({"ERROR"}, say("No face was received yet."))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_live_subject(_Running, Operator):
    """Let the face follow this person"""

    bl_idname = "risorius.live_subject"
    bl_label = "Follow"

    name: bpy.props.StringProperty(name="Subject", options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        choices(context).subject = self.name
        return {"FINISHED"}


def _finish(
    operator: Operator,
    context: Context,
    finish: Callable[[ArmatureObject, bpy.types.Scene], clip_actions.Report | None],
) -> bool:
    """Convert a recording to an action of the active face, and report the action or the error.

    Args:
        operator: operator that reports.
        context: context with the face and the scene.
        finish: function that converts the recording; it gets the face's deforming armature and
            the scene, and returns None for an empty recording.

    Returns:
        Whether an action was made. After an error, the recording stays in the list of waiting
        recordings.
    """
    rig = face_rig(context)
    try:
        report = finish(rig, context.scene)
    except native.user_errors() as error:
        why = names.printable(str(error)).rstrip(".")
        operator.report(
            {"ERROR"},
            say(
                "{reason}. The recording waits in the panel Live Capture: finish it there.",
                reason=why,
            ),
        )
        return False
    if report is None:
        operator.report({"WARNING"}, say("Nothing was received, so nothing was recorded."))
        return False
    operator.report({"INFO"}, say(report.summary()))
    for note in report.notes:
        operator.report({"WARNING"}, say(note))
    return True


CLASSES = (
    RISORIUS_OT_live_start,
    RISORIUS_OT_live_stop,
    RISORIUS_OT_live_record,
    RISORIUS_OT_live_finish,
    RISORIUS_OT_live_discard,
    RISORIUS_OT_live_neutral,
    RISORIUS_OT_live_subject,
)
