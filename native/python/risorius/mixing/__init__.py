# SPDX-License-Identifier: MIT
"""Mixes new faces from faces with the same topology and controls, region by region."""

from .compatible import check_compatible, difference
from .hair import without_hair
from .mix import Mix, Places, mix_faces
from .regions import REGIONS, Masks

__all__ = [
    "REGIONS",
    "Masks",
    "Mix",
    "Places",
    "check_compatible",
    "difference",
    "mix_faces",
    "without_hair",
]
