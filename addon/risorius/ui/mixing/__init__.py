# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix Faces: settings, operators and panel."""

from . import operators, panel, properties

CLASSES = (*properties.CLASSES, *operators.CLASSES, *panel.CLASSES)
