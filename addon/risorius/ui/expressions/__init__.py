# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: the grid of pictures, the library, pose assets and menus."""

from . import library_operators, menus, operators, panel, properties, shelf

CLASSES = (
    *properties.CLASSES,
    *operators.CLASSES,
    *library_operators.CLASSES,
    *menus.CLASSES,
    *panel.CLASSES,
    *shelf.CLASSES,
)
