# SPDX-License-Identifier: GPL-3.0-or-later
"""What an animator does by hand: poses between poses, tweaks, blinks, what the eyes look at."""
