# SPDX-License-Identifier: GPL-3.0-or-later
"""Speech: animates a face from a sound file, and corrects the result."""

from . import correcting, install, operators, panel

CLASSES = (*operators.CLASSES, *install.CLASSES, *correcting.CLASSES, *panel.CLASSES)
