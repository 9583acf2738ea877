# SPDX-License-Identifier: GPL-3.0-or-later
"""A character's objects: built, compiled, shown and placed."""
