# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools for animation by hand: breakdown poses, blinks, favourite sliders."""
