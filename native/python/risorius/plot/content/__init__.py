# SPDX-License-Identifier: MIT
"""What the pages show: numbers taken from a DNA, without drawing."""
