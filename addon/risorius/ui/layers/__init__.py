# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers and reactions: lists, operators, menus and panel."""

from . import lists, menus, operators, panel

CLASSES = (*operators.CLASSES, *menus.CLASSES, *lists.CLASSES, *panel.CLASSES)
