# SPDX-License-Identifier: GPL-3.0-or-later
"""Between faces and DNA files: import, sample faces, replace, reload, export, rigs, studios."""

from . import framing_operators, import_operators, operators, rig_operators, studio_operators

CLASSES = (
    *import_operators.CLASSES,
    *operators.CLASSES,
    *rig_operators.CLASSES,
    *studio_operators.CLASSES,
    *framing_operators.CLASSES,
)
