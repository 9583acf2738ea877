# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotates the eyes of a face towards a target, and moves the lids with the eyes."""
