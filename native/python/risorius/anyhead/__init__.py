# SPDX-License-Identifier: MIT
"""A rig on a head without expressions, and a DNA file's own topology fitted to any head."""
