# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the eyes look, what holds their target, and how lids and head follow."""
