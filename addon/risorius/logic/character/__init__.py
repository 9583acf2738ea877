# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a character is built, how it is grouped and what was edited."""
