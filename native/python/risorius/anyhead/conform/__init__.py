# SPDX-License-Identifier: MIT
"""A DNA file's own topology on another head: everything that a face has takes that head's form."""

from .face import conform
from .head import Conformed, conform_face, is_same_topology

__all__ = ["Conformed", "conform", "conform_face", "is_same_topology"]
