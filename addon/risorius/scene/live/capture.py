# SPDX-License-Identifier: GPL-3.0-or-later
"""Live capture onto characters: a timer writes the newest face to the sliders and the head bone.

Packets are received on a thread of `risorius.live`, which knows nothing of Blender. The timer takes
the newest frame, if there is a new one, and writes it as a hand on the sliders would: no keys, no
undo steps. What was there before is put back at the end, however it ends. No Blender object is
kept: characters are found anew at each tick.

A recording becomes an action when it is finished. One that cannot, whose face went away or whose
file is closed waits in memory until it is finished or thrown away: nobody acts the same twice.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import bpy
from bpy.app.handlers import persistent
from mathutils import Euler, Quaternion

from ... import native
from ...logic.animation.clip_units import ClipError
from ...logic.base import names
from ..animation import actions, clip_actions, layers
from ..base import parts
from ..base.blender_types import ArmatureObject, current_context
from ..character import runtime

INTERVAL = 1 / 60  # seconds; faster than a phone sends helps nobody
_REDRAW = 0.25  # seconds between redraws of the status
_HEAD = "head"

_sessions: dict[int, Session] = {}  # session uid of a control armature -> Session
_receivers: dict[
    tuple[str, int, str], native.Receiver
] = {}  # (source, port, host) -> the Receiver of all sessions that listen there
_waiting: list[Recording] = []  # Recordings that ended without becoming an action, the oldest first
_last: dict[str, Any] = {"error": "", "redraw": 0.0, "undone": False}


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
class Recording:
    """What was recorded, or is being recorded.

    Attributes:
        take: risorius.live.Take.
        shaper: risorius.live.Shaper, of the capture that it belongs to.
        frame: of the scene, when it began.
        face: name of the control armature.
    """

    take: native.Take
    shaper: native.Shaper
    frame: float
    face: str = ""


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


def of(controls: bpy.types.Object | None) -> Session | None:
    """The Session of a control armature, or None."""
    return _sessions.get(controls.session_uid) if controls is not None else None


def last_error() -> str:
    """Why the last capture ended by itself; "" if it did not."""
    return _last["error"]


def start(rig: ArmatureObject, settings: Settings) -> Session:
    """Let a character follow a subject.

    Args:
        rig: its deforming armature.
        settings: Settings.

    Returns:
        Session.

    Raises:
        risorius.live.LiveError: the port cannot be had; python-osc is missing.
        risorius.importing.MappingError: the mapping cannot be used.
    """
    live = native.part("live")
    shaper = live.Shaper(settings.mapping)
    controls = parts.controls_there(rig)
    stop(controls)
    host = live.EVERYWHERE if settings.everywhere else live.THIS_MACHINE
    key = (settings.source, settings.port, host)
    if key not in _receivers:
        receiver = live.Receiver(settings.source, settings.port, host)
        receiver.start()
        _receivers[key] = receiver
    session = Session(controls.session_uid, controls.name, key, shaper, settings.subject)
    _sessions[session.uid] = session
    _last["error"] = ""
    apply_settings(session, settings)
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=INTERVAL)
    return session


def apply_settings(session: Session, settings: Settings) -> None:
    """Take over what can change while it runs: subject, smoothing, gains.

    Args:
        session: of the character.
        settings: as they are now; source, port and mapping are left as they were at the start.
    """
    session.subject = settings.subject
    session.shaper.smoothing = settings.smoothing
    session.shaper.gain, session.shaper.head_gain = settings.gain, settings.head_gain


def stop(controls: bpy.types.Object | None) -> bool:
    """End the capture of a character and put back what was there before.

    Returns:
        Whether there was one. A recording that was not finished waits, see waiting.
    """
    session = of(controls)
    if session is None:
        return False
    _end(session)
    return True


def stop_all() -> None:
    """End every capture; characters that are still there get their values back."""
    for session in list(_sessions.values()):
        _end(session)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


def _end(session: Session) -> None:
    """Close a session whatever state its character is in: nothing of the user's goes with it."""
    _lay_by(session)
    try:
        controls = session.controls()
        if controls is not None:
            _put_back(session, controls)
    finally:
        _close(session)


def _close(session: Session) -> None:
    del _sessions[session.uid]
    if not any(other.key == session.key for other in _sessions.values()):
        _receivers.pop(session.key).stop()


def _lay_by(session: Session) -> Recording | None:
    """End a session's recording; it waits, if anything was recorded. Returns: it, or None."""
    recording, session.recording = session.recording, None
    if recording is None or not len(session.receiver.finish(recording.take)):
        return None
    recording.face = session.name
    _waiting.append(recording)
    return recording


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


def address() -> str:
    """What a phone's app takes for this computer; "" where it is in no network."""
    return native.part("live").own_address()


def begin_take(session: Session, frame: float) -> None:
    """Record from now.

    Args:
        session: of the character.
        frame: of the scene at which the take is to begin.
    """
    take = session.receiver.record(session.subject)
    session.recording = Recording(take, session.shaper, frame)


def finish_take(
    session: Session, rig: ArmatureObject, scene: bpy.types.Scene
) -> clip_actions.Report | None:
    """Stop recording; the character plays what was recorded.

    Args:
        session: a Session that records.
        rig: the character.
        scene: gives the rate; its frame when the recording began is the take's first.

    Returns:
        clip_actions.Report, or None where nothing came.

    Raises:
        clip_units.ClipError: as finish; what was recorded then waits to be finished again.
    """
    recording = _lay_by(session)
    return finish(recording, rig, scene) if recording is not None else None


def waiting() -> tuple[Recording, ...]:
    """The recordings that wait to be finished: a tuple of Recordings, the oldest first."""
    return tuple(_waiting)


def discard(recording: Recording) -> None:
    """Throw away a recording that waits."""
    _waiting.remove(recording)


def finish(
    recording: Recording, rig: ArmatureObject, scene: bpy.types.Scene
) -> clip_actions.Report:
    """Let a character play a recording that waits; then it waits no more.

    Args:
        recording: of waiting(); made with this character or with another.
        rig: the character.
        scene: gives the rate.

    Returns:
        clip_actions.Report.

    Raises:
        clip_units.ClipError: nothing of it is for this face, it is longer than Blender can play,
            or the NLA is being edited.
    """
    controls, take = parts.controls_there(rig), recording.take
    trouble = actions.busy(controls)
    if trouble:
        raise ClipError(trouble)
    clip = take.clip(recording.shaper)
    timing = clip_actions.timing_of(clip, scene, recording.frame)
    report = clip_actions.make_action(
        rig, clip, timing, f"Live {names.printable(take.subject, 40)}"
    )
    if take.full:
        report.notes.append(f"The take is full: {take.full} faces were left out.")
    layers.keep_weights(controls, clip_actions.play(rig, report.action))
    scene.frame_end = max(scene.frame_end, round(report.last))
    _waiting.remove(recording)
    return report


def _tick() -> float | None:
    """One beat of the timer; returns the seconds to the next, None to end."""
    try:
        return _beat()
    except Exception:
        # Blender drops a timer that fails; what it fed must not go on listening.
        _last["error"] = "Live capture ended by an error, which the console shows."
        for session in list(_sessions.values()):
            with contextlib.suppress(Exception):  # the first error is the one to show
                _end(session)
        raise


def _beat() -> float | None:
    if bpy.app.is_job_running("RENDER"):
        return INTERVAL  # what a render reads is not to be written
    if _last["undone"]:
        _last["undone"] = False
        current_context().view_layer.update()  # bones that undo brought back are not there before
    changed = False
    for session in list(_sessions.values()):
        controls = session.controls()
        if controls is None or runtime.of(parts.rig_of(controls) or controls) is None:
            _last["error"] = f"The face {session.name} went away: its capture ended."
            _end(session)
            continue
        changed |= show(session, controls)
    _redraw(changed)
    return INTERVAL if _sessions else None


def show(session: Session, controls: ArmatureObject) -> bool:
    """Write the newest face to a character, if it is a new one.

    Args:
        session: of the character.
        controls: its control armature.

    Returns:
        Whether there was one.
    """
    frame = session.receiver.latest(session.subject)
    if frame is None or frame.sequence == session.sequence:
        return False
    session.sequence = frame.sequence
    shaper = session.shaper
    shaper.maximum = parts.maximum_of(controls)
    controlled, values = shaper.apply(frame)
    if controlled != session.names:
        _plan(session, controls, controlled)
    bone, values = controls.pose.bones[parts.FACE], values.tolist()
    for slider, place in session.sliders:
        if slider not in session.before:
            session.before[slider] = bone.get(slider, 0.0)
        bone[slider] = values[place]
    if shaper.head_gain:
        _turn_head(session, controls, dict(zip(controlled, values, strict=True)))
    controls.update_tag()
    return True


def _plan(session: Session, controls: ArmatureObject, controlled: tuple[str, ...]) -> None:
    """Which value goes to which slider of this character."""
    rig = parts.rig_of(controls)
    assert rig is not None
    live = runtime.there(rig)
    places = {name: place for place, name in enumerate(controlled)}
    face = controls.pose.bones[parts.FACE]
    found = {}
    for label, name in zip(live.labels, live.dna.raw_control_names, strict=True):
        place = places.pop(name, None)
        if place is not None and label in face:
            found[label] = place
    session.names, session.sliders = controlled, tuple(found.items())


def _turn_head(session: Session, controls: ArmatureObject, values: Mapping[str, float]) -> None:
    bone = controls.pose.bones.get(_HEAD)
    if bone is None or f"{_HEAD}.yaw" not in values:
        return
    if session.turn is None:
        session.turn = _rotation(bone)
    yaw, pitch, roll = (values.get(f"{_HEAD}.{a}", 0.0) for a in ("yaw", "pitch", "roll"))
    # The face looks along -y, its own left is +x: yaw about z, then pitch about -x, then roll.
    turn = Quaternion((0.0, 0.0, 1.0), yaw) @ Quaternion((1.0, 0.0, 0.0), -pitch)
    turn = turn @ Quaternion((0.0, 1.0, 0.0), roll)
    rest = bone.bone.matrix_local.to_quaternion()
    _rotate(bone, rest.inverted() @ turn @ rest)


def _rotation(bone: bpy.types.PoseBone) -> tuple[str, tuple[float, ...]]:
    """A bone's rotation mode, and its rotation as that keeps it."""
    return bone.rotation_mode, tuple(getattr(bone, clip_actions.rotation_path(bone)))


def _as_quaternion(mode: str, values: Sequence[float]) -> Quaternion:
    """What _rotation gave, for a bone that is turned in another way by now."""
    if mode == "QUATERNION":
        return Quaternion(values).normalized()
    if mode == "AXIS_ANGLE":
        return Quaternion(values[1:], values[0])
    return Euler(values, mode).to_quaternion()


def _rotate(bone: bpy.types.PoseBone, turn: Quaternion) -> None:
    if bone.rotation_mode == "QUATERNION":
        bone.rotation_quaternion = turn
    elif bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
    else:
        before = Euler(bone.rotation_euler[:], bone.rotation_mode)
        bone.rotation_euler = turn.to_euler(bone.rotation_mode, before)


def _put_back(session: Session, controls: ArmatureObject) -> None:
    """Write the values of before the capture."""
    bone = controls.pose.bones[parts.FACE]
    for slider, value in session.before.items():
        if slider in bone:
            bone[slider] = value
    head = controls.pose.bones.get(_HEAD)
    if session.turn is not None and head is not None:
        mode, values = session.turn
        if head.rotation_mode == mode:
            setattr(head, clip_actions.rotation_path(head), values)
        else:
            _rotate(head, _as_quaternion(mode, values))
    session.before.clear()
    session.turn, session.sequence = None, 0
    controls.update_tag()


def _redraw(changed: bool) -> None:
    """Let the views show a change at once, and the sidebars the status now and then."""
    _last["redraw"] += INTERVAL
    status = _last["redraw"] >= _REDRAW
    kinds = {"WINDOW": changed, "UI": status}
    if status:
        _last["redraw"] = 0.0
    for window in current_context().window_manager.windows if changed or status else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if kinds.get(region.type):
                        region.tag_redraw()


@persistent
def _before_load(*_arguments: object) -> None:
    stop_all()


@persistent
def _before_save(*_arguments: object) -> None:
    """The file shall keep the face as it was; the next tick goes on."""
    for session in _sessions.values():
        controls = session.controls()
        if controls is not None:
            _put_back(session, controls)


@persistent
def _undone(*_arguments: object) -> None:
    _last["undone"] = True
    for session in _sessions.values():
        session.sequence = 0


_HANDLERS = (
    ("load_pre", _before_load),
    ("save_pre", _before_save),
    ("undo_post", _undone),
    ("redo_post", _undone),
)


def register() -> None:
    """Add the handlers."""
    _last.update(error="", redraw=0.0, undone=False)
    for name, handler in _HANDLERS:
        present = getattr(bpy.app.handlers, name)
        if handler not in present:
            present.append(handler)


def unregister() -> None:
    """End all captures and remove the handlers."""
    stop_all()
    for name, handler in reversed(_HANDLERS):
        present = getattr(bpy.app.handlers, name)
        if handler in present:
            present.remove(handler)
