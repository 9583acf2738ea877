# SPDX-License-Identifier: MIT
"""A DNA file's own topology on another head: everything that a face has takes that head's form."""

from .face import conform

__all__ = ["conform"]
