# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds landmarks of a head without expressions, and makes a face from the head."""
