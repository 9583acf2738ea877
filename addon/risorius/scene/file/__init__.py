# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces the DNA file of a character, exports its edits, and builds new DNA files."""
