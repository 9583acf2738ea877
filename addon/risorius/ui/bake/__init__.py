# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking faces to plain actions, and the return to live evaluation."""

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
