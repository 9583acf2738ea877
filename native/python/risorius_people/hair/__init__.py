# SPDX-License-Identifier: MIT
"""Guides that grow from the skin, cards along them, and the binding of cards to a face."""

from .making import Grown, add_hair, grow_hair, hair_metadata, hair_picture

__all__ = ["Grown", "add_hair", "grow_hair", "hair_metadata", "hair_picture"]
