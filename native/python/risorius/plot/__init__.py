# SPDX-License-Identifier: MIT
"""Draws figures of a rig: joint matrix, levels of detail, face with joints, file sizes.

Dna + bytes of the file --facts--> Facts --draw_*--> figures --page | sheet--> .html | .png

`regions`, `skeleton`, `layers`, `matrix` and `shade` compute with NumPy alone; only `paper` and
the drawing modules import Matplotlib, which is the optional extra `plot`.
"""
