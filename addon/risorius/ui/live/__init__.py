# SPDX-License-Identifier: GPL-3.0-or-later
"""Live capture: choices, operators, panel."""

from . import operators, panel, properties

CLASSES = (*properties.CLASSES, *operators.CLASSES, *panel.CLASSES)
