# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: on the sliders, as pose assets, in menus."""

from . import menus, operators

CLASSES = (*operators.CLASSES, *menus.CLASSES)
