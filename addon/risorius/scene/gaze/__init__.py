# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaze: eyes, their target, and lids and head that follow."""
