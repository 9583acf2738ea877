# SPDX-License-Identifier: MIT
"""Reads heads with expressions from files or other programs, and makes faces of blend shapes."""
