# SPDX-License-Identifier: GPL-3.0-or-later
"""Manages the live capture sessions of characters, and the receivers that sessions share.

A session is the live capture of one character. A subject is a captured face, with the name that the
sending app gives it. No Blender object is kept: a character is found again each time and may be
deleted.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import cast

import bpy

from ... import native
from ..base import parts
from ..base import session as registry
from ..base.blender_types import ArmatureObject
from .recordings import Recording

# Session uid of a control armature -> Session.
_sessions: dict[int, Session] = registry.table("sessions.sessions", ("unregister",))
# (kind of source, port, host) -> the Receiver that all sessions with these three settings share.
_receivers: dict[tuple[str, int, str], native.Receiver] = registry.table(
    "sessions.receivers", ("unregister",)
)


@dataclass
class Settings:
    """Settings of a capture.

    Attributes:
        source: "livelink" or "osc".
        port: port to listen on.
        everywhere: True: other computers can send; False: only this one.
        subject: name of the phone; "" for the first one received.
        smoothing: strength of the smoothing, 0 (none) to 1.
        gain, head_gain: factors of all captured controls and of head rotations; head_gain 0: the
            head does not turn.
        mapping: name or file of the mapping to controls.
    """

    source: str = "livelink"
    port: int = 0
    everywhere: bool = False
    subject: str = ""
    smoothing: float = 0.3
    gain: float = 1.0
    head_gain: float = 1.0
    mapping: str = "arkit"


@dataclass
class Session:
    """The live capture of a character that follows a subject, such as the face on a phone.

    Attributes:
        uid, name: session uid and last name of the control armature.
        key: (source, port, host) of its receiver.
        shaper: risorius.live.Shaper, which converts captured faces to controls.
        subject: name of the subject; "" for the first one received.
        sequence: number of the last written frame.
        before: slider -> value before the capture.
        turn: (rotation mode, values of the rotation) of the head bone before the capture, or None.
        recording: the running Recording, or None.
        recent: the last 3600 captured frames, also of earlier subjects: one minute at 60 frames per
            second.
        ranges_seen: value of range_properties.changes() when the shaper got the capture ranges.
        names: control names of the last frame.
        sliders: (slider, index in `names`) for each name that this character has.
    """

    uid: int
    name: str
    key: tuple[str, int, str]
    shaper: native.Shaper
    subject: str = ""
    sequence: int = 0
    before: dict[str, float] = field(default_factory=dict)
    turn: tuple[str, tuple[float, ...]] | None = None
    recording: Recording | None = None
    recent: deque[native.Frame] = field(default_factory=lambda: deque(maxlen=3600))
    ranges_seen: int = -1
    names: tuple[str, ...] = ()
    sliders: tuple[tuple[str, int], ...] = ()

    @property
    def receiver(self) -> native.Receiver:
        return _receivers[self.key]

    def controls(self) -> ArmatureObject | None:
        """The control armature; None if it was deleted or lacks the bone with the sliders."""
        item = cast("ArmatureObject | None", bpy.data.objects.get(self.name))
        if item is None or item.session_uid != self.uid:
            found = (o for o in bpy.data.objects if o.session_uid == self.uid)
            item = cast("ArmatureObject | None", next(found, None))
        if item is None or item.type != "ARMATURE" or parts.FACE not in item.pose.bones:
            return None
        self.name = item.name
        return item


def running() -> list[Session]:
    """A new list of all sessions, so that sessions may be closed during a loop."""
    return list(_sessions.values())


def of(controls: bpy.types.Object | None) -> Session | None:
    """The Session of a control armature, or None."""
    return _sessions.get(controls.session_uid) if controls is not None else None


def begin(controls: ArmatureObject, shaper: native.Shaper, settings: Settings) -> Session:
    """Begin a session of a character that has none, so that it follows a subject.

    Args:
        controls: its control armature.
        shaper: shaper with the mapping of the settings.
        settings: Settings.

    Raises:
        risorius.live.LiveError: the port is in use, or python-osc is missing.
    """
    live = native.part("live")
    host = live.EVERYWHERE if settings.everywhere else live.THIS_MACHINE
    key = (settings.source, settings.port, host)
    if key not in _receivers:
        receiver = live.Receiver(settings.source, settings.port, host)
        receiver.start()
        _receivers[key] = receiver
    session = Session(controls.session_uid, controls.name, key, shaper, settings.subject)
    _sessions[session.uid] = session
    apply_settings(session, settings)
    return session


def apply_settings(session: Session, settings: Settings) -> None:
    """Apply settings that can change during a capture: subject, smoothing, gains.

    Args:
        session: session of the character.
        settings: new settings; changes of source, port and mapping are ignored.
    """
    session.subject = settings.subject
    _reserve(session.key)
    session.shaper.smoothing = settings.smoothing
    session.shaper.gain, session.shaper.head_gain = settings.gain, settings.head_gain


def close(session: Session) -> None:
    """End a session; its receiver stops if no other session uses it."""
    del _sessions[session.uid]
    if any(other.key == session.key for other in _sessions.values()):
        _reserve(session.key)
    else:
        _receivers.pop(session.key).stop()


def _reserve(key: tuple[str, int, str]) -> None:
    """Let a receiver reserve a place for each subject that a session chose by name.

    Other senders then cannot displace these subjects.
    """
    chosen = {s.subject for s in _sessions.values() if s.key == key and s.subject}
    _receivers[key].reserve(chosen)


def neutral_now(session: Session) -> bool:
    """Use the newest received face as neutral face, which is subtracted from all later faces.

    Returns:
        Whether the session has received a face.
    """
    frame = session.receiver.latest(session.subject)
    if frame is None:
        return False
    session.shaper.capture(frame)
    session.sequence = 0  # so that the newest face is written again
    return True


def forget_neutral(session: Session) -> None:
    """Show received faces without subtracting a neutral face."""
    session.shaper.capture(None)
    session.sequence = 0
