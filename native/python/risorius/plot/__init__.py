# SPDX-License-Identifier: MIT
"""Draws a rig: the joint matrix, the levels of detail, the face with its joints, the sizes.

Dna + bytes of the file --facts--> Facts --draw_*--> figures --page | sheet--> .html | .png

`regions`, `skeleton`, `layers`, `matrix` and `shade` compute with NumPy alone; only `paper` and
the drawing modules import Matplotlib, which is the optional extra `plot`.
"""
