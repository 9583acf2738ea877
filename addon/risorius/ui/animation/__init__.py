# SPDX-License-Identifier: GPL-3.0-or-later
"""Animation that comes in from files and from other rigs."""

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
