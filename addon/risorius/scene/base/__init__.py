# SPDX-License-Identifier: GPL-3.0-or-later
"""How the parts of a character are found and kept, and what differs between Blenders."""
