# SPDX-License-Identifier: GPL-3.0-or-later
"""The face board: added, removed, led by, selected, brought to rest."""

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
