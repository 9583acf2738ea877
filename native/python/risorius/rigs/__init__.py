# SPDX-License-Identifier: MIT
"""Loads, checks and edits DNA files, and caches compiled rigs."""
