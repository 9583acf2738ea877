# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers Blender's application handlers, which update characters."""
