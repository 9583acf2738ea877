# SPDX-License-Identifier: GPL-3.0-or-later
"""Moving controls by hand: keys, poses between poses, tweaks, favourites, the pie menu."""
