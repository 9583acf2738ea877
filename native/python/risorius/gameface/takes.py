# SPDX-License-Identifier: MIT
"""Reads frames of captures as weights of ARKit units."""

from __future__ import annotations

from pathlib import Path

from .. import importing
from ..controls import vocabulary
from ..controls.arkit import mapping
from .errors import GameFaceError

MOST = 500
"""Largest number of frames taken from a capture, spread evenly."""


def frames_of(path: Path) -> list[dict[str, float]]:
    """At most MOST (500) frames of a capture, evenly spread, each as ARKit unit -> weight.

    Args:
        path: path of a Live Link Face file, or of another file whose curves are ARKit units.

    Raises:
        GameFaceError: no curve is an ARKit unit.
        AnimationFileError: the file is damaged or not an animation.
    """
    clip = importing.read(path).clip
    arkit = vocabulary.vocabulary(vocabulary.ARKIT)
    found = {arkit.spelled(name): row for name, row in zip(clip.names, clip.curves, strict=True)}
    rows = {unit: found[unit] for unit in mapping() if unit in found}
    if not rows:
        raise GameFaceError(
            f"{path}: curves of ARKit's units were expected, such as jawOpen; found "
            f"{', '.join(clip.names[:6]) or 'none'}"
        )
    every = max(1, -(-clip.frame_count // MOST))
    return [
        {unit: float(row[i]) for unit, row in rows.items()}
        for i in range(0, clip.frame_count, every)
    ]
