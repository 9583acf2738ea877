# SPDX-License-Identifier: MIT
"""What the controls of a face are called: regions, sides, ARKit units, names for people."""
