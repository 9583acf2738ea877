# SPDX-License-Identifier: GPL-3.0-or-later
"""Interface for heads without expressions: landmarks, Make Rig from Head, Conform Face to Head."""

from . import landmark_operators, operators, panel

CLASSES = (*operators.CLASSES, *landmark_operators.CLASSES, *panel.CLASSES)
