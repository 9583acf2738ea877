# SPDX-License-Identifier: MIT
"""Collects the data of the drawings from a DNA file, without Matplotlib."""
