# SPDX-License-Identifier: MIT
"""Computes meshes and their motion by joints, for all parts of rig authoring."""
