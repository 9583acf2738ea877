# SPDX-License-Identifier: GPL-3.0-or-later
"""Animation that leaves Blender: through its own exporters, as a clip or as a table."""

from . import operators, web

CLASSES = (*operators.CLASSES, *web.CLASSES)
