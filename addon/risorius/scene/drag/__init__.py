# SPDX-License-Identifier: GPL-3.0-or-later
"""Drags the face in the viewport: the user pulls a point of the skin, and the sliders follow."""
