# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix Faces: choices, operators, panel."""

from . import operators, panel, properties

CLASSES = (*properties.CLASSES, *operators.CLASSES, *panel.CLASSES)
