# SPDX-License-Identifier: MIT
"""Unpacks mesh data that meshoptimizer or Draco packed."""
