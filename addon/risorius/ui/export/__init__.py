# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports animation with Blender's exporters, as a clip or as a table; exports faces."""

from . import game_face, operators, web

CLASSES = (*operators.CLASSES, *web.CLASSES, *game_face.CLASSES)
