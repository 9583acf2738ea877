# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns recordings of live capture into actions, or keeps them in memory for the user.

A recording waits if it cannot become an action at its end, or if its face or .blend file is gone,
because a performance cannot be repeated.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ... import native
from ...logic.animation.clip_units import ClipError
from ...logic.base import names
from ..animation import actions, board_keys, clip_actions, layers
from ..base import parts
from ..base import session as registry
from ..base.blender_types import ArmatureObject
from ..character import standing

# Recordings that ended and are not an action yet, the oldest first.
_waiting: list[Recording] = registry.keep("recordings.waiting", list, ("quit",))


@dataclass
class Recording:
    """A finished or running recording.

    Attributes:
        take: the recorded samples, a risorius.live.Take.
        shaper: risorius.live.Shaper, which converted the captured faces to controls.
        frame: frame of the scene at the start of the recording.
        face: name of the control armature.
    """

    take: native.Take
    shaper: native.Shaper
    frame: float
    face: str = ""


def lay_by(recording: Recording) -> None:
    """Keep an ended recording until it is finished or discarded."""
    _waiting.append(recording)


def waiting() -> tuple[Recording, ...]:
    """The ended recordings that are not an action yet, the oldest first."""
    return tuple(_waiting)


def discard(recording: Recording) -> None:
    """Delete a waiting recording."""
    _waiting.remove(recording)


def finish(
    recording: Recording, rig: ArmatureObject, scene: bpy.types.Scene
) -> clip_actions.Report:
    """Turn a waiting recording into an action that a character plays.

    Args:
        recording: from waiting(); made with this or another character.
        rig: the character.
        scene: scene with the frame rate; its end is extended to the end of the recording.

    Returns:
        clip_actions.Report.

    Raises:
        clip_units.ClipError: no control of the recording fits this face, the recording is longer
            than Blender can play, or the NLA is being edited.
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
    report.notes += board_keys.onto_leader(rig, report.action)
    layers.keep_weights(controls, clip_actions.play(rig, report.action))
    left = standing.beside(rig).sentence
    report.notes += [left] if left is not None else []
    scene.frame_end = max(scene.frame_end, round(report.last))
    _waiting.remove(recording)
    return report
