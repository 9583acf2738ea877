# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: on the sliders, in a grid of pictures, as pose assets, in menus."""

from . import library_operators, menus, operators, panel, properties, shelf

CLASSES = (
    *properties.CLASSES,
    *operators.CLASSES,
    *library_operators.CLASSES,
    *menus.CLASSES,
    *panel.CLASSES,
    *shelf.CLASSES,
)
