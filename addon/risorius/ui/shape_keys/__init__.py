# SPDX-License-Identifier: GPL-3.0-or-later
"""Assigns a head's shape keys to controls, with pictures, before a rig is made from the head."""

from . import curves, operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES, *curves.CLASSES)
