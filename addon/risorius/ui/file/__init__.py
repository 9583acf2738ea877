# SPDX-License-Identifier: GPL-3.0-or-later
"""Between faces and DNA files: import, the sample face, replace, reload, export, and new rigs."""

from . import import_operators, operators, rig_operators

CLASSES = (*import_operators.CLASSES, *operators.CLASSES, *rig_operators.CLASSES)
