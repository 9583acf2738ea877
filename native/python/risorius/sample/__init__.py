# SPDX-License-Identifier: MIT
"""A free sample person, built from CC0 data through our own writer."""

from .build import build_sample
from .source import SourceError

__all__ = ["SourceError", "build_sample"]
