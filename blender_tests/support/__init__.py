# SPDX-License-Identifier: GPL-3.0-or-later
"""Helper modules of the tests that run inside Blender."""
