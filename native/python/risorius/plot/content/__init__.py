# SPDX-License-Identifier: MIT
"""Data of the drawings, taken from a DNA without drawing."""
