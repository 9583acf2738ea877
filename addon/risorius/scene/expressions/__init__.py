# SPDX-License-Identifier: GPL-3.0-or-later
"""Manages expressions: libraries, blending onto sliders, pictures and pose assets."""
