# SPDX-License-Identifier: MIT
"""Reads the user's character from glTF or VRM, so that a game face is exported on that body."""
