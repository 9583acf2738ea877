# SPDX-License-Identifier: GPL-3.0-or-later
"""See Why: the causes of the motion of each vertex, in millimetres."""
