# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixes matching faces into a new one: a preview that follows the sliders, and the file."""
