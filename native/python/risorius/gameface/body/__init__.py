# SPDX-License-Identifier: MIT
"""A character of the user's own, which a game face is hung on."""
