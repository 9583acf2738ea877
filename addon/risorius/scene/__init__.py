# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans to Blender objects, poses to Blender objects."""
