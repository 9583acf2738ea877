# SPDX-License-Identifier: MIT
"""Finished faces with fewer joints, correctives and levels of detail."""

from .lighten import ExpressionError, LightenReport, Size, lighten

__all__ = ["ExpressionError", "LightenReport", "Size", "lighten"]
