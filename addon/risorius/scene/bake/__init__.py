# SPDX-License-Identifier: GPL-3.0-or-later
"""Animation of a face as plain actions."""
