# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeps characters whole: duplicates, renames, links, repairs, migrations of older files."""
