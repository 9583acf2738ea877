# SPDX-License-Identifier: MIT
"""Finds eyes, teeth, tongue, lashes and brows of a head, and adds missing ones from a template."""

from .completing import complete, head_parts
from .fitted import Bodies, Fitted, Fittings
from .sorting import sort_parts

__all__ = ["Bodies", "Fitted", "Fittings", "complete", "head_parts", "sort_parts"]
