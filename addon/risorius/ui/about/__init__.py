# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences, the list of a face's contents, and the timing overlay."""

from . import operators, preferences

CLASSES = (*preferences.CLASSES, *operators.CLASSES)
