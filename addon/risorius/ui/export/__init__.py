# SPDX-License-Identifier: GPL-3.0-or-later
"""Export of animation with Blender's exporters, as a clip or as a table, and of faces."""

from . import game_face, operators, web

CLASSES = (*operators.CLASSES, *web.CLASSES, *game_face.CLASSES)
