# SPDX-License-Identifier: MIT
"""Animation over time: clips and their files, mixed layers, reactions, idle life."""
