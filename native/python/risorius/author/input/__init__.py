# SPDX-License-Identifier: MIT
"""Heads with expressions, from files or from a program, as faces of blend shapes."""
