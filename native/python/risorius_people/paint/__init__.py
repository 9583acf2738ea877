# SPDX-License-Identifier: MIT
"""Textures of the sample people, painted from anatomy: each texel knows its place on the head.

Colours are sRGB in [0, 1]; lengths are decimetres.
"""
