# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the materials of characters, with their nodes and images."""
