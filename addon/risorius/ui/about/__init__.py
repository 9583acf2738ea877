# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences, the contents of a face, the self-test and the timing overlay."""

from . import operators, preferences

CLASSES = (*preferences.CLASSES, *operators.CLASSES)
