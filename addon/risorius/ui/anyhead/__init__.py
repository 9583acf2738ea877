# SPDX-License-Identifier: GPL-3.0-or-later
"""A head without expressions: its landmarks, a rig on it, a face that takes its form."""

from . import landmark_operators, operators, panel

CLASSES = (*operators.CLASSES, *landmark_operators.CLASSES, *panel.CLASSES)
