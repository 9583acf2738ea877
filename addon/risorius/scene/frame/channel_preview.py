# SPDX-License-Identifier: GPL-3.0-or-later
"""Overrides the weight of one blend shape channel for a test, until the next change.

The deforming armature stores the override with the frame and a hash of the raw controls. If either
changes, the override ends, so that no frame depends on a forgotten test. Saving and rendering end
it too.
"""

from __future__ import annotations

import hashlib

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base import last_written, parts, saved
from ..base.blender_types import ArmatureObject

_MOST = 1000.0  # largest absolute weight of an override


def set_override(rig: ArmatureObject, channel: int, value: float) -> None:
    """Override the weight of one channel; the caller evaluates afterwards.

    Args:
        rig: deforming armature.
        channel: index of the channel.
        value: weight of the channel.
    """
    rig[parts.TEST] = {"channel": int(channel), "value": float(value), "under": ""}


def clear(rig: ArmatureObject) -> bool:
    """End the override of a character.

    Returns:
        Whether the character had an override.
    """
    if parts.TEST not in rig:
        return False
    del rig[parts.TEST]
    return True


def clear_all() -> bool:
    """End the overrides of all characters; the next update evaluates their faces.

    Returns:
        Whether at least one character had an override.
    """
    ended = [rig for rig in parts.rigs() if clear(rig)]
    for rig in ended:
        last_written.forget()
        controls = parts.controls_of(rig)
        if controls is not None:
            controls.update_tag()
    return bool(ended)


def current(rig: ArmatureObject | None) -> tuple[int, float] | None:
    """The override of a character: (channel, weight), or None."""
    return _kept(rig)[0] if rig is not None and parts.TEST in rig else None


def _kept(rig: ArmatureObject) -> tuple[tuple[int, float] | None, str]:
    """The stored override (channel, weight) or None, and the stored text of frame and controls."""
    kept = saved.table(rig, parts.TEST) or {}
    channel = saved.whole(kept, "channel", -1, 0)
    test = (channel, saved.number(kept, "value", 0.0, -_MOST, _MOST)) if channel >= 0 else None
    return test, saved.text(kept, "under")


def override(
    rig: ArmatureObject, raw: NDArray[np.float32], scene: bpy.types.Scene
) -> tuple[int, float] | None:
    """The override for this evaluation; an outdated override is removed.

    Args:
        rig: deforming armature.
        raw: float32[R] raw controls.
        scene: the evaluated scene.

    Returns:
        (channel, weight), or None.
    """
    if parts.TEST not in rig:
        return None
    test, kept = _kept(rig)
    digest = hashlib.sha1(raw.tobytes(), usedforsecurity=False).hexdigest()
    under = f"{scene.frame_current_final:.6f} {digest}"
    if test is None or kept not in ("", under):
        clear(rig)
        return None
    rig[parts.TEST]["under"] = under
    return test


def apply(test: tuple[int, float] | None, weights: NDArray[np.float32]) -> None:
    """Write an override into a pose's channel weights, in place.

    Args:
        test: (channel, weight) from `override`; None changes nothing.
        weights: float32[C], changed.
    """
    if test is not None and test[0] < len(weights):
        weights[test[0]] = test[1]
