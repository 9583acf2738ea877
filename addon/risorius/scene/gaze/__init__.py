# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaze: turns the eyes towards a target, and moves the lids with the eyes."""
