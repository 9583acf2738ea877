# SPDX-License-Identifier: MIT
"""Animation in time: clips and their files, layers that are mixed, reactions, idle life."""
