# SPDX-License-Identifier: MIT
"""Controls beyond the 52 ARKit units, from the data's shapes or from code."""

from .places import find_places
from .recipes import CONTROLS_OF_CODE, further_units, unit_shape

__all__ = ["CONTROLS_OF_CODE", "find_places", "further_units", "unit_shape"]
