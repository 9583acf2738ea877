# SPDX-License-Identifier: GPL-3.0-or-later
"""Live capture: settings, operators and panel; the capture range of a person."""

from . import operators, panel, properties, range_operators, range_panel

CLASSES = (
    *properties.CLASSES,
    *operators.CLASSES,
    *range_operators.CLASSES,
    *panel.CLASSES,
    *range_panel.CLASSES,
)
