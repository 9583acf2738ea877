# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Live Capture: connection, recording and received faces."""

from ...logic.base import names
from ...scene.live import capture, recordings, sessions
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, active_controls
from .properties import RISORIUS_PG_live, choices


class RISORIUS_PT_live(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_live"
    bl_label = "Live Capture"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        chosen = choices(context)
        session = sessions.of(active_controls(context))
        column = layout.column()
        column.enabled = session is None
        column.prop(chosen, "source", text="")
        column.prop(chosen, "port")
        column.prop(chosen, "everywhere")
        words.write(column, _where(chosen))
        words.prop_or(column, chosen, "mapping", "", "Empty: names of ARKit and VRM")
        words.prop_or(layout, chosen, "subject", "", "Empty: the first person received")
        column = layout.column(align=True)
        for name in ("smoothing", "gain", "head_gain"):
            column.prop(chosen, name)
        _draw_waiting(layout)
        if session is None:
            layout.operator("risorius.live_start", icon="PLAY")
            if capture.last_error():
                words.write(layout, capture.last_error(), "ERROR")
            return
        row = layout.row(align=True)
        row.operator("risorius.live_stop", icon="SNAP_FACE")
        recording = session.recording is not None
        text = "Finish Recording" if recording else "Record"
        row.operator("risorius.live_record", text=text, icon="REC", depress=recording)
        row = layout.row(align=True)
        row.operator("risorius.live_neutral")
        row.operator("risorius.live_neutral", text="", icon="X").forget = True
        layout.operator("risorius.learn_range_live", text="Learn Range", icon="DRIVER_DISTANCE")
        _draw_status(layout, session)


def _where(chosen: RISORIUS_PG_live) -> str:
    """A sentence with the IP address and the port that the user types into the capture app."""
    if not chosen.everywhere:
        return words.say("Hears this computer only, at 127.0.0.1, port {port}.", port=chosen.port)
    address = capture.address() or words.say("this computer's address")
    return words.say("In the app: {address}, port {port}.", address=address, port=chosen.port)


def _draw_waiting(layout: UILayout) -> None:
    """Draw the recordings that are not actions yet."""
    for index, recording in enumerate(recordings.waiting()):
        box = layout.box()
        count = len(recording.take)
        text = words.say(
            "{name}: {count} faces wait in a recording", name=recording.face, count=count
        )
        words.show(box, names.printable(text, 60), "REC")
        row = box.row(align=True)
        row.operator("risorius.live_finish").index = index
        here = row.operator("risorius.live_finish", text="Finish Here")
        here.index, here.at_current = index, True
        row.operator("risorius.live_discard", text="", icon="TRASH").index = index


def _draw_status(layout: UILayout, session: sessions.Session) -> None:
    status = session.receiver.status(session.subject)
    column = layout.column(align=True)
    column.scale_y = 0.8
    if not status.subject:
        heard = "Port {port}: nothing heard yet"
        if status.packets:
            heard = "Port {port}: data without a face"
        words.show(column, words.say(heard, port=session.receiver.port), "INFO")
    else:
        rate = f"{status.per_second:.0f}"
        words.show(
            column,
            words.say("Faces from {name}: {rate} a second", name=status.subject, rate=rate),
            "USER",
        )
        age = f"{(status.age or 0.0) * 1000:.0f}"
        words.show(column, words.say("Last face {age} ms ago", age=age), "BLANK1")
    if session.recording is not None:
        count = len(session.recording.take)
        words.show(column, words.say("Recording: {count} faces", count=count), "REC")
    for count, what in (
        (status.lost, words.say("Lost Packets")),
        (status.late, words.say("Late, Left Out")),
        (status.refused, words.say("Packets Refused")),
        (status.floods, words.say("Floods")),
    ):
        if count:
            words.show(column, f"{what}: {count}", "ERROR")
    if status.reasons:
        words.write(layout, names.printable(status.reasons[0][0], 120))
    missed = session.shaper.unmapped
    if missed:
        left_out = names.printable(", ".join(missed), 120)
        words.write(layout, words.say("Not mapped: {names}", names=left_out))
    others = [s for s in status.subjects if s != status.subject]
    for name in others[:8]:
        button = layout.operator("risorius.live_subject", text=name, icon="USER", translate=False)
        button.name = name


CLASSES = (RISORIUS_PT_live,)
