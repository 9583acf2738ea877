# SPDX-License-Identifier: GPL-3.0-or-later
"""Solo and mute: shows a face with some controls only, or without joints, shapes or animated maps.

The controls keep their values, so keys, bakes and exports do not change. The deforming armature
stores the setting, so that undo restores it. During a save the setting is removed, so that
files do not contain it. Renders ignore it unless the user chooses otherwise.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base import last_written, parts, saved, session
from ..base.blender_types import ArmatureObject
from ..character import runtime

KINDS = ("JOINTS", "SHAPES", "MAPS")
# Session uid of a deforming armature -> setting that is removed while a file is saved.
_held: dict[int, str] = session.table("look_masks.held", ("unregister",))


@dataclass(frozen=True)
class Look:
    """The solo and mute setting of a face.

    Attributes:
        solo: labels of the only controls that have an effect; empty: all.
        muted: parts of the pose that stay neutral, from KINDS: joints, blend shapes, animated maps.
        in_renders: whether renders use the setting too.
    """

    solo: frozenset[str] = frozenset()
    muted: frozenset[str] = frozenset()
    in_renders: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether no control is solo and no part of the face is muted."""
        return not self.solo and not self.muted


WHOLE = Look()


def of(rig: ArmatureObject) -> Look:
    """The solo and mute setting of a character.

    Args:
        rig: the character's deforming armature.
    """
    kept = rig.get(parts.LOOK)
    if not isinstance(kept, str):
        return WHOLE
    renders, muted, *solo = [*kept.split("\n"), ""][: max(2, kept.count("\n") + 1)]
    return Look(frozenset(solo), frozenset(muted.split()), renders == "1")


def put(rig: ArmatureObject, look: Look) -> None:
    """Store the solo and mute setting of a character; the caller evaluates afterwards.

    Args:
        rig: the deforming armature.
        look: the new setting.
    """
    if look.is_whole:
        rig.pop(parts.LOOK, None)
    else:
        muted = " ".join(sorted(look.muted))
        rig[parts.LOOK] = "\n".join((str(int(look.in_renders)), muted, *sorted(look.solo)))


def solo(rig: ArmatureObject, names: Collection[str]) -> None:
    """Let only some controls have an effect; muted parts stay muted.

    Args:
        rig: deforming armature.
        names: labels of the controls that keep their effect; empty: all controls.
    """
    put(rig, replace(of(rig), solo=frozenset(names)))


def mute(rig: ArmatureObject, kind: str, on: bool) -> None:
    """Mute or unmute the joints, blend shapes or animated maps of a face.

    Args:
        rig: deforming armature.
        kind: an entry of KINDS.
        on: True: mute; False: unmute.
    """
    look = of(rig)
    put(rig, replace(look, muted=look.muted | {kind} if on else look.muted - {kind}))


def for_frame(rig: ArmatureObject, is_render: bool) -> Look:
    """The setting that this evaluation uses.

    Args:
        rig: deforming armature.
        is_render: whether the frame is rendered.
    """
    look = of(rig)
    return WHOLE if is_render and not look.in_renders else look


def raw_of(look: Look, raw: NDArray[np.float32], live: runtime.Runtime) -> NDArray[np.float32]:
    """Set all controls outside the solo list to their rest values.

    Args:
        look: the setting.
        raw: float32[R], raw controls.
        live: the Runtime of the character.

    Returns:
        float32[R], the raw controls to evaluate.
    """
    if not look.solo:
        return raw
    alone = np.array([label in look.solo for label in live.labels])
    return np.where(alone, raw, np.array(live.rests, np.float32)).astype(np.float32)


def apply(look: Look, pose: native.Pose, live: runtime.Runtime, lod: int) -> None:
    """Set the muted parts of a pose (joints, blend shapes, animated maps) to their rest values.

    Args:
        look: the setting.
        pose: pose of the character's rig; changed.
        live: Runtime of the character.
        lod: level of detail of the pose.
    """
    if not look.muted:
        return
    rest = live.rig.evaluate(np.array(live.rests, np.float32), lod)
    if "JOINTS" in look.muted:
        pose.joints[:] = rest.joints
    if "SHAPES" in look.muted:
        pose.blend_shapes[:] = rest.blend_shapes
    if "MAPS" in look.muted:
        pose.animated_maps[:] = rest.animated_maps


def take_away() -> bool:
    """Remove the solo and mute settings of all characters before a file is saved.

    Returns:
        Whether at least one character had a setting.
    """
    _held.clear()
    for rig in parts.rigs():
        if parts.LOOK in rig:
            _held[rig.session_uid] = saved.text(rig, parts.LOOK)
            del rig[parts.LOOK]
            bring_up_later(rig)
    return bool(_held)


def give_back() -> bool:
    """Restore the solo and mute settings that `take_away` removed.

    Returns:
        Whether `take_away` had removed at least one setting.
    """
    given = bool(_held)
    for rig in parts.rigs():
        kept = _held.pop(rig.session_uid, None)
        if kept:
            rig[parts.LOOK] = kept
            bring_up_later(rig)
    _held.clear()
    return given


def bring_up_later(rig: ArmatureObject) -> None:
    """Make the next update evaluate a character."""
    last_written.forget()
    controls = parts.controls_of(rig)
    if controls is not None:
        controls.update_tag()
