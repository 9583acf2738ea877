# SPDX-License-Identifier: GPL-3.0-or-later
"""Import of animation from files, moving meshes and other rigs."""

from . import mesh_operators, operators, panel, rest_operators

CLASSES = (*operators.CLASSES, *mesh_operators.CLASSES, *rest_operators.CLASSES, *panel.CLASSES)
