# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows hair cards as hair strands in renders."""
