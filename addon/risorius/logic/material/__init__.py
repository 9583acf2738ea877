# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds textures by name, reads animated maps, and computes masks from the form of a face."""
