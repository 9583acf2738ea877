# SPDX-License-Identifier: GPL-3.0-or-later
"""Describes controls, lists their search words, and translates the interface and the errors."""
