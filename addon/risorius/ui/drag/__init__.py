# SPDX-License-Identifier: GPL-3.0-or-later
"""Dragging the skin in the 3D view: tool, operators, settings and drawing."""

from . import handle_operators, operators, panel, properties, tool

CLASSES = (
    *properties.CLASSES,
    *operators.CLASSES,
    *handle_operators.CLASSES,
    *tool.CLASSES,
    *panel.CLASSES,
)
