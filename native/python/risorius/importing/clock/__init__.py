# SPDX-License-Identifier: MIT
"""The times of a file's frames: units of time in various spellings, and timecodes."""
