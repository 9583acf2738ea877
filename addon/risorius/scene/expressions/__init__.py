# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: where they come from, on the sliders, as pictures and as pose assets."""
