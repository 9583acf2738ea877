# SPDX-License-Identifier: GPL-3.0-or-later
"""Speech: converting a sound file to movement of the face, and correcting it."""

from . import correcting, install, operators, panel

CLASSES = (*operators.CLASSES, *install.CLASSES, *correcting.CLASSES, *panel.CLASSES)
