# SPDX-License-Identifier: MIT
"""Fits a small statistical model of the shape of heads to a surface."""
