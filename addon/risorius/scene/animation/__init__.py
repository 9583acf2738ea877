# SPDX-License-Identifier: GPL-3.0-or-later
"""Animates the controls of a character: actions, clips, layers, keys and tweaks."""
