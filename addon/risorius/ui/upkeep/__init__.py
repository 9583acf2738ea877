# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairs faces that are linked from other files or have lost parts."""

from . import operators

CLASSES = (*operators.CLASSES,)
