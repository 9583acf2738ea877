# SPDX-License-Identifier: GPL-3.0-or-later
"""Live capture: operators, the choices that they read, and their panel."""

import bpy

from .. import native
from ..logic.base import names
from ..scene.base import parts
from ..scene.live import capture
from . import words
from .import_operators import usable
from .panels import FaceOnlyPanel, write

SOURCES = (
    ("livelink", "Live Link Face", "Epic's app for iPhones and iPads, in its ARKit mode"),
    ("osc", "VMC / OSC", "VMC performers, Face Cap, iFacialMocap by OSC, or plain /name value"),
)
PORTS = {"livelink": 11111, "osc": 39539}


def _source_changed(self, _context):
    self.port = PORTS[self.source]


def _changed(_self, context):
    session = capture.of(_controls(context))
    if session is not None:
        capture.apply_settings(session, settings_of(context))


class RISORIUS_PG_live(bpy.types.PropertyGroup):
    """What the user chose; it goes with the window."""

    source: bpy.props.EnumProperty(
        name="Source", description="Who sends", items=SOURCES, update=_source_changed
    )
    port: bpy.props.IntProperty(
        name="Port",
        description="UDP port to listen at, the one that the app sends to",
        default=PORTS["livelink"],
        min=1,
        max=65535,
    )
    everywhere: bpy.props.BoolProperty(
        name="From the Network",
        description="Hear any device of the network, as a phone needs; off: programs of this "
        "computer alone. In a network that is not your own, others could move the face",
        default=False,
    )
    subject: bpy.props.StringProperty(
        name="Subject",
        description="Whom to follow, by the name that the app sends; empty for the first heard",
        update=_changed,
    )
    mapping: bpy.props.StringProperty(
        name="Mapping",
        description="File that says which controls a name moves; empty for ARKit's names and VRM's",
        subtype="FILE_PATH",
    )
    smoothing: bpy.props.FloatProperty(
        name="Smoothing",
        description="Hold a still face still; a recording keeps what was sent",
        default=0.3,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    gain: bpy.props.FloatProperty(
        name="Gain",
        description="Factor on all units of the face",
        default=1.0,
        min=0.0,
        max=3.0,
        update=_changed,
    )
    head_gain: bpy.props.FloatProperty(
        name="Head",
        description="Factor on the head's turn: 0 leaves the head alone, -1 turns it around",
        default=1.0,
        min=-2.0,
        max=2.0,
        update=_changed,
    )


def settings_of(context):
    """The choices as scene/live/capture.py takes them."""
    chosen = context.window_manager.risorius_live
    return capture.Settings(
        chosen.source,
        chosen.port,
        chosen.everywhere,
        chosen.subject,
        chosen.smoothing,
        chosen.gain,
        chosen.head_gain,
        bpy.path.abspath(chosen.mapping) or "arkit",
    )


def _controls(context):
    rig = None if native.problem() else parts.active_rig(context)
    return parts.controls_of(rig) if rig is not None else None


class _Running:
    """What operators share that need a capture of the active face."""

    @classmethod
    def poll(cls, context):
        if not usable(cls):
            return False
        if capture.of(_controls(context)) is None:
            cls.poll_message_set("Start live capture first.")
            return False
        return True


class RISORIUS_OT_live_start(bpy.types.Operator):
    """Let the active face follow a capture app, until it is stopped"""

    bl_idname = "risorius.live_start"
    bl_label = "Start"

    @classmethod
    def poll(cls, context):
        if not usable(cls):
            return False
        if _controls(context) is None:
            cls.poll_message_set("Select a face first.")
            return False
        return True

    def execute(self, context):
        try:
            capture.start(parts.active_rig(context), settings_of(context))
        except native.user_errors() as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_live_stop(_Running, bpy.types.Operator):
    """Stop following; a recording is finished, or waits; the sliders go back to where they were"""

    bl_idname = "risorius.live_stop"
    bl_label = "Stop"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        session = capture.of(_controls(context))
        if session.recording is not None:
            _finish(self, context, lambda *where: capture.finish_take(session, *where))
        capture.stop(_controls(context))
        return {"FINISHED"}


class RISORIUS_OT_live_record(_Running, bpy.types.Operator):
    """Begin a recording at the current frame, or end it as an action of the face"""

    bl_idname = "risorius.live_record"
    bl_label = "Record"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        session = capture.of(_controls(context))
        if session.recording is None:
            capture.begin_take(session, float(context.scene.frame_current))
            return {"FINISHED"}
        done = _finish(self, context, lambda *where: capture.finish_take(session, *where))
        return {"FINISHED"} if done else {"CANCELLED"}


class _Waiting:
    """What operators share that need a recording that waits."""

    index: bpy.props.IntProperty(
        name="Recording", description="Which one of those that wait", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, _context):
        if not usable(cls):
            return False
        if not capture.waiting():
            cls.poll_message_set("No recording waits to be finished.")
            return False
        return True

    def recording(self):
        """The Recording that is meant, or None."""
        found = capture.waiting()
        if not 0 <= self.index < len(found):
            self.report({"ERROR"}, f"There is no recording {self.index}: {len(found)} wait.")
            return None
        return found[self.index]


class RISORIUS_OT_live_finish(_Waiting, bpy.types.Operator):
    """Let the active face play a recording that waits"""

    bl_idname = "risorius.live_finish"
    bl_label = "Finish"
    bl_options = {"REGISTER", "UNDO"}

    at_current: bpy.props.BoolProperty(
        name="At Current Frame",
        description="Begin at the scene's frame of now, not where the recording began",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if _controls(context) is None:
            cls.poll_message_set("Select a face first.")
            return False
        return True

    def execute(self, context):
        recording = self.recording()
        if recording is None:
            return {"CANCELLED"}
        if self.at_current:
            recording.frame = float(context.scene.frame_current)
        done = _finish(self, context, lambda *where: capture.finish(recording, *where))
        return {"FINISHED"} if done else {"CANCELLED"}


class RISORIUS_OT_live_discard(_Waiting, bpy.types.Operator):
    """Throw away a recording that waits; this cannot be undone"""

    bl_idname = "risorius.live_discard"
    bl_label = "Throw Away"

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, _context):
        recording = self.recording()
        if recording is None:
            return {"CANCELLED"}
        capture.discard(recording)
        return {"FINISHED"}


class RISORIUS_OT_live_neutral(_Running, bpy.types.Operator):
    """Take the face of this moment as the face at rest: it is subtracted from what comes"""

    bl_idname = "risorius.live_neutral"
    bl_label = "Neutral Now"

    forget: bpy.props.BoolProperty(
        name="Forget", description="Take what comes as it is again", options={"SKIP_SAVE"}
    )

    def execute(self, context):
        session = capture.of(_controls(context))
        if self.forget:
            capture.forget_neutral(session)
        elif not capture.neutral_now(session):
            self.report({"ERROR"}, "No face was received yet.")
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_live_subject(_Running, bpy.types.Operator):
    """Follow this subject"""

    bl_idname = "risorius.live_subject"
    bl_label = "Follow"

    name: bpy.props.StringProperty(name="Subject", options={"SKIP_SAVE"})

    def execute(self, context):
        context.window_manager.risorius_live.subject = self.name
        return {"FINISHED"}


def _finish(operator, context, finish):
    """End a recording as an action.

    Args:
        operator: reports how it went.
        context: has the face and the scene.
        finish: called with both.

    Returns:
        Whether there is an action. Where there is none, what was recorded waits.
    """
    rig = parts.active_rig(context)
    try:
        report = finish(rig, context.scene)
    except native.user_errors() as error:
        why = names.printable(str(error)).rstrip(".")
        operator.report({"ERROR"}, f"{why}. The recording waits: finish it in the panel.")
        return False
    if report is None:
        operator.report({"WARNING"}, "Nothing was received: there is no recording.")
        return False
    length = f"{report.curves} curves, frames {report.first:.0f} to {report.last:.0f}"
    operator.report({"INFO"}, f"{report.action.name}: {length}")
    for note in report.notes:
        operator.report({"WARNING"}, note)
    return True


class RISORIUS_PT_live(FaceOnlyPanel, bpy.types.Panel):
    bl_idname = "RISORIUS_PT_live"
    bl_label = "Live Capture"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        chosen = context.window_manager.risorius_live
        session = capture.of(_controls(context))
        column = layout.column()
        column.enabled = session is None
        column.prop(chosen, "source", text="")
        column.prop(chosen, "port")
        column.prop(chosen, "everywhere")
        write(column, _where(chosen))
        words.prop_or(column, chosen, "mapping", "", "Empty: names of ARKit and VRM")
        words.prop_or(layout, chosen, "subject", "", "Empty: the first heard")
        column = layout.column(align=True)
        for name in ("smoothing", "gain", "head_gain"):
            column.prop(chosen, name)
        _draw_waiting(layout)
        if session is None:
            layout.operator("risorius.live_start", icon="PLAY")
            if capture.last_error():
                write(layout, capture.last_error(), "ERROR")
            return
        row = layout.row(align=True)
        row.operator("risorius.live_stop", icon="SNAP_FACE")
        recording = session.recording is not None
        text = "Finish Recording" if recording else "Record"
        row.operator("risorius.live_record", text=text, icon="REC", depress=recording)
        row = layout.row(align=True)
        row.operator("risorius.live_neutral")
        row.operator("risorius.live_neutral", text="", icon="X").forget = True
        _draw_status(layout, session)


def _where(chosen):
    """What to type into the app."""
    if not chosen.everywhere:
        return f"Hears this computer only, at 127.0.0.1, port {chosen.port}."
    address = capture.address() or "this computer's address"
    return f"In the app: {address}, port {chosen.port}."


def _draw_waiting(layout):
    """The recordings that are no action yet."""
    for index, recording in enumerate(capture.waiting()):
        box = layout.box()
        words = f"{recording.face}: {len(recording.take)} faces wait"
        box.label(text=names.printable(words, 60), icon="REC")
        row = box.row(align=True)
        row.operator("risorius.live_finish").index = index
        here = row.operator("risorius.live_finish", text="Finish Here")
        here.index, here.at_current = index, True
        row.operator("risorius.live_discard", text="", icon="TRASH").index = index


def _draw_status(layout, session):
    status = session.receiver.status(session.subject)
    column = layout.column(align=True)
    column.scale_y = 0.8
    if not status.subject:
        heard = "no face in what comes" if status.packets else "nothing heard yet"
        column.label(text=f"Port {session.receiver.port}: {heard}", icon="INFO")
    else:
        column.label(text=f"{status.subject}: {status.per_second:.0f} a second", icon="USER")
        column.label(text=f"Last face {status.age * 1000:.0f} ms ago", icon="BLANK1")
    if session.recording is not None:
        column.label(text=f"Recording: {len(session.recording.take)} faces", icon="REC")
    for count, what in (
        (status.lost, "Lost on the way"),
        (status.late, "Late, left out"),
        (status.refused, "Packets refused"),
        (status.floods, "Floods"),
    ):
        if count:
            column.label(text=f"{what}: {count}", icon="ERROR")
    if status.reasons:
        write(layout, names.printable(status.reasons[0][0], 120))
    missed = session.shaper.unmapped
    if missed:
        write(layout, f"Not mapped: {names.printable(', '.join(missed), 120)}")
    others = [s for s in status.subjects if s != status.subject]
    for name in others[:8]:
        layout.operator("risorius.live_subject", text=name, icon="USER").name = name


CLASSES = (
    RISORIUS_PG_live,
    RISORIUS_OT_live_start,
    RISORIUS_OT_live_stop,
    RISORIUS_OT_live_record,
    RISORIUS_OT_live_finish,
    RISORIUS_OT_live_discard,
    RISORIUS_OT_live_neutral,
    RISORIUS_OT_live_subject,
    RISORIUS_PT_live,
)
