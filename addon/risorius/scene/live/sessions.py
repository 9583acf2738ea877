# SPDX-License-Identifier: GPL-3.0-or-later
"""Who follows whom: a Session for each captured character, and the receivers that they share.

No Blender object is kept: a character is found anew each time, and may have gone away.
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
# (source, port, host) -> the Receiver of all sessions that listen there
_receivers: dict[tuple[str, int, str], native.Receiver] = registry.table(
    "sessions.receivers", ("unregister",)
)


@dataclass
class Settings:
    """What the user chose.

    Attributes:
        source: "livelink" or "osc"; port, everywhere: where to listen, to the network or not.
        subject: the phone; "" for the one heard first.
        mapping: name or file of the mapping to controls.
        smoothing: 0 to 1; gain: on all units; head_gain: on the head's turn, 0 for none.
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
    """One character that follows one subject.

    Attributes:
        uid: of the control armature; name: as it was last seen, to find it soon.
        key: of its receiver.
        shaper: risorius.live.Shaper.
        subject: whom it follows; "" for the one heard first.
        sequence: of the frame that was written last.
        before: slider -> value before the capture.
        turn: the head bone's (rotation mode, rotation as that mode keeps it) before it, or None.
        recording: Recording, while one is made.
        recent: the frames that were shown lately, of any subject: a minute of 60 a second.
        ranges_seen: range_properties.changes() when the shaper got the ranges of the face.
        names, sliders: the control names of the last frame, and (slider, place) of those that this
            character has.
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
        """The control armature, or None where it went away."""
        item = cast("ArmatureObject | None", bpy.data.objects.get(self.name))
        if item is None or item.session_uid != self.uid:
            found = (o for o in bpy.data.objects if o.session_uid == self.uid)
            item = cast("ArmatureObject | None", next(found, None))
        if item is None or item.type != "ARMATURE" or parts.FACE not in item.pose.bones:
            return None
        self.name = item.name
        return item


def running() -> list[Session]:
    """All sessions; one may be closed while they are gone through."""
    return list(_sessions.values())


def of(controls: bpy.types.Object | None) -> Session | None:
    """The Session of a control armature, or None."""
    return _sessions.get(controls.session_uid) if controls is not None else None


def begin(controls: ArmatureObject, shaper: native.Shaper, settings: Settings) -> Session:
    """Let a character follow a subject; it must have no session.

    Args:
        controls: its control armature.
        shaper: of the settings' mapping.
        settings: Settings.

    Raises:
        risorius.live.LiveError: the port cannot be had; python-osc is missing.
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
    """Take over what can change while it runs: subject, smoothing, gains.

    Args:
        session: of the character.
        settings: as they are now; source, port and mapping are left as they were at the start.
    """
    session.subject = settings.subject
    _reserve(session.key)
    session.shaper.smoothing = settings.smoothing
    session.shaper.gain, session.shaper.head_gain = settings.gain, settings.head_gain


def close(session: Session) -> None:
    """End a session, and its receiver where no other listens there."""
    del _sessions[session.uid]
    if any(other.key == session.key for other in _sessions.values()):
        _reserve(session.key)
    else:
        _receivers.pop(session.key).stop()


def _reserve(key: tuple[str, int, str]) -> None:
    """Let a receiver keep a place for each subject that somebody chose."""
    chosen = {s.subject for s in _sessions.values() if s.key == key and s.subject}
    _receivers[key].reserve(chosen)


def neutral_now(session: Session) -> bool:
    """Take the face of this moment as the face at rest. Returns: whether one was there."""
    frame = session.receiver.latest(session.subject)
    if frame is None:
        return False
    session.shaper.capture(frame)
    session.sequence = 0  # written again, as it is now
    return True


def forget_neutral(session: Session) -> None:
    """Take what comes as it is again."""
    session.shaper.capture(None)
    session.sequence = 0
