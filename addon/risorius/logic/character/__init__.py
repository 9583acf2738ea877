# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans of a character: its parts, its groups, and the user's edits."""
