# SPDX-License-Identifier: GPL-3.0-or-later
"""Upkeep of characters: duplicates, renames, links, repairs, migrations of older files."""
