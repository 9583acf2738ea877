# SPDX-License-Identifier: GPL-3.0-or-later
"""What needs no Blender: names, groups of controls, spaces, plans. Imports neither bpy nor
the native module."""
