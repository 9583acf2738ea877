# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools for animation by hand: poses between poses, blinks, favourites."""
