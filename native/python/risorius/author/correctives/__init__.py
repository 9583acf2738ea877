# SPDX-License-Identifier: MIT
"""Correctives: what goes wrong where expressions meet, found and repaired."""

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
