# SPDX-License-Identifier: GPL-3.0-or-later
"""The face board: operators that add, remove, select and reset it, and its panel."""

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
