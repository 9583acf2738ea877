# SPDX-License-Identifier: MIT
"""Grows hair as guides from the skin, lays cards along them, and binds the cards to a face."""

from .making import Grown, add_hair, grow_hair, hair_metadata, hair_picture

__all__ = ["Grown", "add_hair", "grow_hair", "hair_metadata", "hair_picture"]
