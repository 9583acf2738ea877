# SPDX-License-Identifier: MIT
"""The differences, one module for each layer of a DNA."""
