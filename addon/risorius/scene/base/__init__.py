# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding and storing the parts of a character, and differences between Blender versions."""
