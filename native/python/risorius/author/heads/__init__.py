# SPDX-License-Identifier: MIT
"""Joins a head of several meshes in any unit and direction into one upright face."""
