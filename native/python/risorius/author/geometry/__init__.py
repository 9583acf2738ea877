# SPDX-License-Identifier: MIT
"""Meshes and their motion by joints; independent of how a rig is made."""
