# SPDX-License-Identifier: MIT
"""Fits a small statistical model of the form of heads to a surface."""
