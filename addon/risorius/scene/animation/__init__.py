# SPDX-License-Identifier: GPL-3.0-or-later
"""Actions, clips, layers and expressions on a character's controls."""
