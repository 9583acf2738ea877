# SPDX-License-Identifier: MIT
"""Translates names of controls: regions, sides, ARKit units, and names in other programs."""
