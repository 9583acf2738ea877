# SPDX-License-Identifier: GPL-3.0-or-later
"""Speech: a sound file becomes movement of the face, and what it says can be corrected."""

from . import correcting, install, operators, panel

CLASSES = (*operators.CLASSES, *install.CLASSES, *correcting.CLASSES, *panel.CLASSES)
