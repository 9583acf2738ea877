# SPDX-License-Identifier: GPL-3.0-or-later
"""Animation by hand: keys, breakdown poses, tweaks, gaze, favourites, the pie menu."""

from . import favourites, gaze, operators, panel, pie

CLASSES = (
    *operators.CLASSES,
    *favourites.CLASSES,
    *panel.CLASSES,
    *gaze.CLASSES,
    *pie.CLASSES,
)
