# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans of a character: its armature, meshes, sliders and face boards, and the user's edits."""
