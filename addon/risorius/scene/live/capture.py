# SPDX-License-Identifier: GPL-3.0-or-later
"""Live capture onto characters: a timer writes the newest face to the sliders and the head bone.

A thread of `risorius.live` receives packets and uses no Blender data. The timer writes the newest
frame. At the end the earlier values are restored in every case.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import bpy
from bpy.app.handlers import persistent

from ... import native
from ..animation import clip_actions, range_properties
from ..base import parts
from ..base import session as registry
from ..base.blender_types import ArmatureObject, current_context
from ..character import runtime
from . import recordings, sessions
from .face_writer import put_back, show
from .recordings import Recording
from .sessions import Session, Settings

INTERVAL = 1 / 60  # seconds between two writes; phones send no faster
_REDRAW = 0.25  # seconds between redraws of the status


@dataclass
class _State:
    """State of the timer that writes captured faces."""

    error: str = ""  # why the last capture ended by itself; "" if it did not
    since_redraw: float = 0.0  # seconds since the last redraw of the sidebars
    undone: bool = False  # whether undo or redo ran since the last tick


_state = registry.keep("capture.state", _State, ("unregister",))


def last_error() -> str:
    """Why the last capture ended by itself; "" if it did not."""
    return _state.error


def start(rig: ArmatureObject, settings: Settings) -> Session:
    """Start the live capture of a character, and end an earlier capture of the same character.

    Args:
        rig: the character's deforming armature.
        settings: settings of the capture.

    Returns:
        The running session.

    Raises:
        risorius.live.LiveError: the port cannot be opened, or python-osc is missing.
        risorius.importing.MappingError: the mapping cannot be used.
    """
    shaper = native.part("live").Shaper(settings.mapping)
    controls = parts.controls_there(rig)
    stop(controls)
    session = sessions.begin(controls, shaper, settings)
    _state.error = ""
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=INTERVAL)
    return session


def stop(controls: bpy.types.Object | None) -> bool:
    """End the capture of a character and restore its earlier values.

    Returns:
        Whether a capture ran. Its unfinished recording is kept for recordings.waiting.
    """
    session = sessions.of(controls)
    if session is None:
        return False
    _end(session)
    return True


def stop_all() -> None:
    """End every capture; characters that still exist get their values from before the capture."""
    for session in sessions.running():
        _end(session)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


def _end(session: Session) -> None:
    """Close a session, even if its character was deleted, and keep its recording."""
    _lay_by(session)
    try:
        controls = session.controls()
        if controls is not None:
            put_back(session, controls)
    finally:
        sessions.close(session)


def _lay_by(session: Session) -> Recording | None:
    """End a session's recording and keep it in the list of waiting recordings.

    Returns:
        The recording; None if nothing was recorded.
    """
    recording, session.recording = session.recording, None
    if recording is None or not len(session.receiver.finish(recording.take)):
        return None
    recording.face = session.name
    recordings.lay_by(recording)
    return recording


def address() -> str:
    """The network address of this computer, to enter in a phone's app; "" without a network."""
    return native.part("live").own_address()


def begin_take(session: Session, frame: float) -> None:
    """Begin a recording.

    Args:
        session: session of the character.
        frame: first frame of the take in the scene.
    """
    take = session.receiver.record(session.subject)
    session.recording = Recording(take, session.shaper, frame)


def finish_take(
    session: Session, rig: ArmatureObject, scene: bpy.types.Scene
) -> clip_actions.Report | None:
    """Stop recording and let the character play the take.

    Args:
        session: a Session that records.
        rig: the character.
        scene: scene with the frame rate.

    Returns:
        clip_actions.Report, or None if nothing was received.

    Raises:
        clip_units.ClipError: no control of the recording fits this face, the recording is longer
            than Blender can play, or the NLA is being edited. `recordings` keeps the recording.
    """
    recording = _lay_by(session)
    return recordings.finish(recording, rig, scene) if recording is not None else None


def _tick() -> float | None:
    """The function of the timer: write the newest captured faces to the characters.

    Returns:
        Seconds until the next call; None ends the timer.
    """
    try:
        return _beat()
    except Exception:
        # Blender removes a timer after an error, so the sessions that it updates must end too.
        _state.error = "Live capture ended by an error, which the console shows."
        for session in sessions.running():
            with contextlib.suppress(Exception):  # the first error is the one to show
                _end(session)
        raise


def _beat() -> float | None:
    if bpy.app.is_job_running("RENDER"):
        return INTERVAL  # values must not change while a render reads them
    if _state.undone:
        _state.undone = False
        current_context().view_layer.update()  # bones that undo restored exist only after this
    changed = False
    for session in sessions.running():
        controls = session.controls()
        if controls is None or runtime.of(parts.rig_of(controls) or controls) is None:
            _state.error = f"The face {session.name} went away: its capture ended."
            _end(session)
            continue
        changed |= show(session, controls)
    _redraw(changed)
    return INTERVAL if sessions.running() else None


def _redraw(changed: bool) -> None:
    """Redraw the 3D views if a face has changed, and the sidebars every _REDRAW seconds."""
    _state.since_redraw += INTERVAL
    status = _state.since_redraw >= _REDRAW
    kinds = {"WINDOW": changed, "UI": status}
    if status:
        _state.since_redraw = 0.0
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
    """Restore the values that faces had before the capture, so that the file stores these values.

    The next call of the timer shows the capture again.
    """
    for session in sessions.running():
        controls = session.controls()
        if controls is not None:
            put_back(session, controls)


@persistent
def _undone(*_arguments: object) -> None:
    _state.undone = True
    range_properties.touch()
    for session in sessions.running():
        session.sequence = 0


_HANDLERS = (
    ("load_pre", _before_load),
    ("save_pre", _before_save),
    ("undo_post", _undone),
    ("redo_post", _undone),
)


def register() -> None:
    """Add the handlers for load, save, undo and redo."""
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
