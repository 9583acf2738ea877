# SPDX-License-Identifier: GPL-3.0-or-later
"""Another DNA file for a character, and its edits as a DNA file."""
