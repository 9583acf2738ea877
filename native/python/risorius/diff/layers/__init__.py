# SPDX-License-Identifier: MIT
"""What differs, one file for each layer of a DNA."""
