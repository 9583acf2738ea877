# SPDX-License-Identifier: MIT
"""Free sample people, made from CC0 data and written as DNA files by risorius."""

from .build import build_sample
from .people import PEOPLE, Person
from .source import DATA_SIZE, SourceError, is_fetched

__all__ = ["DATA_SIZE", "PEOPLE", "Person", "SourceError", "build_sample", "is_fetched"]
