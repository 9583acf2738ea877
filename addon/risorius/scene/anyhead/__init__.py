# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks of a head without expressions, and the tasks that make a face from it."""
