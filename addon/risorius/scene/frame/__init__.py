# SPDX-License-Identifier: GPL-3.0-or-later
"""One frame: controls in, pose out, written to the scene."""
