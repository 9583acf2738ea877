# SPDX-License-Identifier: GPL-3.0-or-later
"""A head without expressions: its landmarks, and how it becomes a face."""
