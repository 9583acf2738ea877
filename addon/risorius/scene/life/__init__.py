# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens to characters: edits, duplicates, renames, links, older files."""
