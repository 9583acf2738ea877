# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the causes of the motion of each vertex, in millimetres (panel See Why)."""
