# SPDX-License-Identifier: GPL-3.0-or-later
"""Speech: a sound file becomes movement of the face."""

from . import install, operators

CLASSES = (*operators.CLASSES, *install.CLASSES)
