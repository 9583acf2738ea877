# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces baked to plain actions, and back to live."""

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
