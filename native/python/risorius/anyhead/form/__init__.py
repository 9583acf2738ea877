# SPDX-License-Identifier: MIT
"""A small statistical model of the form of heads, and its fit to a surface."""
