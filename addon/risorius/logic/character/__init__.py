# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans the armature, meshes, sliders and face boards of a character; finds the user's edits."""
