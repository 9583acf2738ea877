# SPDX-License-Identifier: GPL-3.0-or-later
"""Which textures and animated maps a material has, read from names and shapes."""
