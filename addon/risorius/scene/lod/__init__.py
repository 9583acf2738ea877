# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels of detail of characters."""
