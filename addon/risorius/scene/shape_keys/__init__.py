# SPDX-License-Identifier: GPL-3.0-or-later
"""Assignments of the shape keys of a head, by names or by the user, and their pictures."""
