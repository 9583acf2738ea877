# SPDX-License-Identifier: GPL-3.0-or-later
"""Code without Blender: names, groups of controls, spaces, plans. It imports neither bpy nor the
native module."""
