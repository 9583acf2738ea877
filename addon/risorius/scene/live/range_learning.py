# SPDX-License-Identifier: GPL-3.0-or-later
"""Gets the last seconds of live capture, from which a person's range of motion is learned."""

from __future__ import annotations

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from .sessions import Session


def recent_clip(session: Session, seconds: float) -> native.Clip:
    """The recent frames of a session, before ranges, gain, smoothing and neutral are applied.

    Args:
        session: session of the character.
        seconds: length of the clip.

    Returns:
        risorius.Clip of raw controls.

    Raises:
        FaceError: nothing was received.
    """
    if not session.recent:
        raise FaceError(told("No face was received yet."))
    live, newest = native.part("live"), session.recent[-1]
    take = live.Take(newest.subject)
    for frame in session.recent:
        if frame.arrival >= newest.arrival - seconds:
            take.add(frame)
    return take.clip(live.Shaper(session.shaper.mapping))
