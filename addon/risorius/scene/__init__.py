# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds characters as Blender objects from plans, and writes their poses to these objects."""
