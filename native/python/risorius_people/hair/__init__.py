# SPDX-License-Identifier: MIT
"""Hair by code: guides that grow from the skin, cards along them, and how they hang on a face."""

from .making import Grown, add_hair, grow_hair, hair_metadata, hair_picture

__all__ = ["Grown", "add_hair", "grow_hair", "hair_metadata", "hair_picture"]
