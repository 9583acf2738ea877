# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds and stores the parts of a character, and hides differences between Blender versions."""
