# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes times, keys, layers and NLA tracks of animation without importing Blender."""
