# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows live captures of a face on characters, and records them."""
