# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports a face for other programs (glTF, FBX, USD, Alembic): animation and plain materials; and
for browsers, as a web page."""
