# SPDX-License-Identifier: MIT
"""Reduces joints, correctives and levels of detail of finished faces."""

from .lighten import ExpressionError, LightenReport, Size, lighten

__all__ = ["ExpressionError", "LightenReport", "Size", "lighten"]
