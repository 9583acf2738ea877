# SPDX-License-Identifier: GPL-3.0-or-later
"""Import, replacement and export of DNA files, sample faces, rigs and studios."""

from . import framing_operators, import_operators, operators, rig_operators, studio_operators

CLASSES = (
    *import_operators.CLASSES,
    *operators.CLASSES,
    *rig_operators.CLASSES,
    *studio_operators.CLASSES,
    *framing_operators.CLASSES,
)
