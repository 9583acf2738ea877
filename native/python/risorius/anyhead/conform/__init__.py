# SPDX-License-Identifier: MIT
"""Conform a face (a DNA file) to another head: the mesh topology, names and counts stay."""

from .face import conform
from .head import Conformed, conform_face, is_same_topology

__all__ = ["Conformed", "conform", "conform_face", "is_same_topology"]
