# SPDX-License-Identifier: MIT
"""Draws figures of a rig: joint matrix, levels of detail, face with joints, file sizes.

`facts` collects the data of a file as Facts. The modules draw_* draw figures from Facts. `page`
writes the figures to an HTML page, `sheet` to a PNG picture.

`regions`, `skeleton`, `layers`, `matrix` and `shade` compute with NumPy alone; only `paper` and
the drawing modules import Matplotlib, which is the optional extra `plot`.
"""
