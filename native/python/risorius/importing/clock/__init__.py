# SPDX-License-Identifier: MIT
"""Reads the times of a file's frames: units of time in various spellings, and timecodes."""
