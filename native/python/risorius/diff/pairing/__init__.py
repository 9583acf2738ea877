# SPDX-License-Identifier: MIT
"""Matches the elements of two DNA files and measures differences of values."""
