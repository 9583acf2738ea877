# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports animation and plain materials for other programs: glTF, FBX, USD, Alembic."""
