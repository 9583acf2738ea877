# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds, compiles, shows and places the objects of a character."""
