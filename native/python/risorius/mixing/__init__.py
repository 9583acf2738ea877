# SPDX-License-Identifier: MIT
"""New faces from some that have the same topology and controls, mixed by region."""

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
