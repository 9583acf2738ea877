# SPDX-License-Identifier: MIT
"""A face as glTF whose morph targets a program drives by name: ARKit, visemes, VRM, expressions."""

from .errors import GameFaceError
from .export import Made, export
from .targets import GROUPS
from .wishes import Wishes

__all__ = ["GROUPS", "GameFaceError", "Made", "Wishes", "export"]
