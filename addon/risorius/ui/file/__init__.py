# SPDX-License-Identifier: GPL-3.0-or-later
"""Between faces and DNA files: import, the sample face, replace, reload, export."""

from . import import_operators, operators

CLASSES = (*import_operators.CLASSES, *operators.CLASSES)
