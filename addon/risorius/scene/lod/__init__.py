# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the levels of detail of characters."""
