# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the Blender objects of a character, sets their poses and animates them."""
