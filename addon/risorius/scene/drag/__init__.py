# SPDX-License-Identifier: GPL-3.0-or-later
"""Dragging the face itself: a point of the skin is pulled, and the sliders follow."""
