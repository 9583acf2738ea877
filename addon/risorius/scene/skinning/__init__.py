# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a pose to bones, which deform meshes by Blender's modifiers, or directly to vertices."""
