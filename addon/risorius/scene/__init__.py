# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds, evaluates, animates, bakes, exports and repairs characters as objects of Blender."""
