# SPDX-License-Identifier: MIT
"""Paints the textures of the sample people from anatomy: each texel has its place on the head.

Colours are sRGB in [0, 1]; lengths are in decimetres.
"""
