# SPDX-License-Identifier: GPL-3.0-or-later
"""Assigns the shape keys of a head to controls, and draws pictures of the shape keys."""
