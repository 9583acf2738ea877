# SPDX-License-Identifier: MIT
"""Draws the figures of the page and the sheet with Matplotlib."""
