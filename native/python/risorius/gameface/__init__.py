# SPDX-License-Identifier: MIT
"""Exports a face as glTF with named morph targets: ARKit units, visemes, VRM, expressions."""

from .errors import GameFaceError
from .export import Made, export
from .targets import GROUPS
from .wishes import Wishes

__all__ = ["GROUPS", "GameFaceError", "Made", "Wishes", "export"]
