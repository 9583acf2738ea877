# SPDX-License-Identifier: GPL-3.0-or-later
"""Drag the Face: choices, operators, drawing in the 3D view."""

from . import handle_operators, operators, panel, properties, tool

CLASSES = (
    *properties.CLASSES,
    *operators.CLASSES,
    *handle_operators.CLASSES,
    *tool.CLASSES,
    *panel.CLASSES,
)
