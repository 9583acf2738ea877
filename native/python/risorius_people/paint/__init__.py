# SPDX-License-Identifier: MIT
"""Textures of the sample people, painted from anatomy: every texel knows where on the head it lies.

Colours are sRGB in [0, 1]; lengths are decimetres.
"""
