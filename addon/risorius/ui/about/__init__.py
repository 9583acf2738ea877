# SPDX-License-Identifier: GPL-3.0-or-later
"""What is there: preferences, the list of what a face is made of, milliseconds per stage."""

from . import operators, preferences

CLASSES = (*preferences.CLASSES, *operators.CLASSES)
