# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates faces at each frame: reads controls, computes the pose, writes it to the scene."""
