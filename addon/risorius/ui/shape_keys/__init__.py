# SPDX-License-Identifier: GPL-3.0-or-later
"""What the shape keys of a head are, before a rig is made of it: a list with pictures."""

from . import curves, operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES, *curves.CLASSES)
