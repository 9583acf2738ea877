# SPDX-License-Identifier: MIT
"""Animates controls over time: clips and their files, mixed layers, reactions, idle movement."""
