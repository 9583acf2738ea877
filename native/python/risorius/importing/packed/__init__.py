# SPDX-License-Identifier: MIT
"""Numbers of meshes that a file holds packed: by meshoptimizer, by Draco."""
