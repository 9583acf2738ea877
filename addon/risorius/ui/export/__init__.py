# SPDX-License-Identifier: GPL-3.0-or-later
"""Animation that leaves Blender: through its own exporters, as a clip or as a table."""

from . import game_face, operators, web

CLASSES = (*operators.CLASSES, *web.CLASSES, *game_face.CLASSES)
