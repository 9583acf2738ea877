# SPDX-License-Identifier: MIT
"""Finds faults of combined expressions, and repairs them by correctives."""

from .adding import add_correctives
from .search import Corrective, CorrectiveOptions, Found, correct_again, find_correctives

__all__ = [
    "Corrective",
    "CorrectiveOptions",
    "Found",
    "add_correctives",
    "correct_again",
    "find_correctives",
]
