# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a face looks as it does: what moves which vertex, and by how much."""
