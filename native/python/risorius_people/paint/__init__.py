# SPDX-License-Identifier: MIT
"""Paints the textures of the sample people by rules of anatomy for each place of the head.

Colours are sRGB in [0, 1]; lengths are in decimetres.
"""
