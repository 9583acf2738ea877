# SPDX-License-Identifier: GPL-3.0-or-later
"""Names, groups of controls, coordinate spaces and plans of Blender data.

The code imports neither bpy nor the native module, so it runs without Blender.
"""
