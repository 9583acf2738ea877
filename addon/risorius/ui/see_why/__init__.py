# SPDX-License-Identifier: GPL-3.0-or-later
"""See Why: causes of a vertex's motion, solo and mute, heat maps, correctives."""

from . import operators, panel, picking, properties

CLASSES = (*properties.CLASSES, *operators.CLASSES, *picking.CLASSES, *panel.CLASSES)
