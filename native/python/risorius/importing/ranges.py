# SPDX-License-Identifier: MIT
"""Converts percentages, bytes and degrees to 0..1 and radians, and refuses implausible values."""

from __future__ import annotations

import numpy as np

from ..anim.clip import Clip
from ..base.errors import ArgumentError
from .errors import AnimationFileError
from .mapping import ANGLES, Mapping

ANGLE_UNITS = ("radians", "degrees")
# A full movement is 1, an exaggerated one up to 2. Values above 4 must be on another scale, such
# as percent; values from 2 to 4 are accepted.
_LARGEST = 4.0
# radians, about 115 degrees; no head turns further
_LARGEST_ANGLE = 2.0
_USUAL = (100.0, 255.0)  # values of a full movement that files use besides 1


def check_options(full: float | None, angles: str | None) -> None:
    """Checks the user's options on the scale of values.

    Args:
        full: the file's value of a full movement, or None.
        angles: the unit of the file's angles, or None.

    Raises:
        ArgumentError: full is not above 0 and below 1e9, or angles is not a known unit.
    """
    if full is not None and not 0.0 < full < 1e9:
        raise ArgumentError(f"full_value: a number above 0 was expected, found {full}")
    if angles is not None and angles not in ANGLE_UNITS:
        raise ArgumentError(
            f"angles: one of {', '.join(ANGLE_UNITS)} was expected, found {angles!r}"
        )


def rescaled(clip: Clip, mapping: Mapping, full: float | None, angles: str | None) -> Clip:
    """Converts a file's curves to the scale of a mapping: a full movement is 1, angles are radians.

    Args:
        clip: curves with the file's own names.
        mapping: identifies the curves that are angles.
        full: the file's value of a full movement; None: 1.
        angles: one of ANGLE_UNITS; None: radians.
    """
    if full in (None, 1.0) and angles != "degrees":
        return clip
    find = mapping.finder()
    factors = np.ones(len(clip.names))
    for i, name in enumerate(clip.names):
        found = find(name)
        if found is not None and found[1] and set(found[1]) <= set(ANGLES):
            factors[i] = np.pi / 180.0 if angles == "degrees" else 1.0
        else:
            factors[i] = 1.0 / (full or 1.0)
    return clip.replaced(curves=clip.curves * factors[:, None])


def refuse_other_scales(clip: Clip, name: str, full: float | None, angles: str | None) -> None:
    """Raises an error if values are far outside the range of their control.

    Args:
        clip: curves of controls and ANGLES.
        name: the file's name in errors.
        full: the file's value of a full movement, if the user gave it; None: not given, so controls
            are checked.
        angles: the unit of the file's angles, if the user gave it; None: not given, so angles are
            checked.

    Raises:
        AnimationFileError: a control above 4, or an angle above 2 radians.
    """
    said = []
    reached = np.abs(clip.curves).max(axis=1, initial=0.0)
    is_angle = np.array([control in ANGLES for control in clip.names], bool)
    controls = np.where(is_angle, 0.0, reached)
    if full is None and controls.max(initial=0.0) > _LARGEST:
        worst = int(controls.argmax())
        whole = next((usual for usual in _USUAL if controls[worst] <= usual * 1.01), 1.0)
        said.append(
            f"1 was expected for a whole movement, found {clip.names[worst]} at "
            f"{controls[worst]:g}: give the value that is whole (clip convert --full-value "
            f"{whole:g}; Full Value in Blender; 1 keeps all as it is)"
        )
    turns = np.where(is_angle, reached, 0.0)
    if angles is None and turns.max(initial=0.0) > _LARGEST_ANGLE:
        worst = int(turns.argmax())
        said.append(
            f"radians were expected, found {clip.names[worst]} at {turns[worst]:g}: give the unit "
            "of the angles (clip convert --angles degrees; Angles in Blender; radians keeps all "
            "as it is)"
        )
    if said:
        raise AnimationFileError(name, "; ".join(said))
