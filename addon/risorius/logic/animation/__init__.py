# SPDX-License-Identifier: GPL-3.0-or-later
"""Times, keys, layers and tracks without Blender."""
