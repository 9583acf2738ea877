# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's operators, panels and menus; the work is done in `scene` and `logic`."""
