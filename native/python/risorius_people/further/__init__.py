# SPDX-License-Identifier: MIT
"""Makes expressions beyond the 52 ARKit units, from the data's shapes or by code."""

from .places import find_places
from .recipes import CONTROLS_OF_CODE, further_units, unit_shape

__all__ = ["CONTROLS_OF_CODE", "find_places", "further_units", "unit_shape"]
