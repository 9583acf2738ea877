# SPDX-License-Identifier: MIT
"""When the frames of a file are: units of time as people spell them, and timecodes."""
