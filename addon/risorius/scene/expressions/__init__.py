# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: libraries, sliders, pictures and pose assets."""
