# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's calculations: plans of Blender data, animation, face boards, textures and names.

The code imports neither bpy nor the native module, so it runs without Blender.
"""
