# SPDX-License-Identifier: MIT
"""Heads as files have them: several meshes, any unit, any direction; made one face that stands."""
