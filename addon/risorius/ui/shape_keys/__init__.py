# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of a head's shape keys with pictures, before a rig is made from it."""

from . import curves, operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES, *curves.CLASSES)
