# SPDX-License-Identifier: MIT
"""Which part of one DNA is which of the other, and how two values differ."""
