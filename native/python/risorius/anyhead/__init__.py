# SPDX-License-Identifier: MIT
"""Transfers a rig to a head without expressions, and conforms the meshes of a DNA file to it."""
