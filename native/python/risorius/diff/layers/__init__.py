# SPDX-License-Identifier: MIT
"""The differences of each layer of a DNA file, with one module per layer."""
