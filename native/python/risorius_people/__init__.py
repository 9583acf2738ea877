# SPDX-License-Identifier: MIT
"""Builds free sample people with face rigs from CC0 data, and writes them as DNA files."""

from .build import build_sample
from .people import PEOPLE, Person
from .source import DATA_SIZE, SourceError, is_fetched

__all__ = ["DATA_SIZE", "PEOPLE", "Person", "SourceError", "build_sample", "is_fetched"]
