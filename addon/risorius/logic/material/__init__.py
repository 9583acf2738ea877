# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures and animated maps of materials, found by names and by the form of the face."""
