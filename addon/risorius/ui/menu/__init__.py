# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu Face in the header of 3D views."""

from . import entries, face_menu

CLASSES = (*entries.CLASSES, *face_menu.CLASSES)
