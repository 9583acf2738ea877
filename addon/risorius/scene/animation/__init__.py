# SPDX-License-Identifier: GPL-3.0-or-later
"""Animates the controls of a character with keyframes, clips, animation layers and tweaks."""
