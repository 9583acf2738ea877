# SPDX-License-Identifier: MIT
"""Matches the parts of two DNAs and measures the difference of values."""
