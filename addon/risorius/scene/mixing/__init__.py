# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixes matching faces into a new face: previews the new face, and writes its DNA file."""
