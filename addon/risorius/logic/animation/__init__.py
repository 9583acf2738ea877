# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes times, keyframes, animation layers and NLA tracks; the code does not import bpy."""
