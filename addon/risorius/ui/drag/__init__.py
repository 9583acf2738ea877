# SPDX-License-Identifier: GPL-3.0-or-later
"""Drag the Face: choices, operators, drawing in the 3D view."""

from . import operators, panel, properties

CLASSES = (*properties.CLASSES, *operators.CLASSES, *panel.CLASSES)
