# SPDX-License-Identifier: MIT
"""Textures of the sample, painted from anatomy: every texel knows where on the head it lies."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def paint_textures(folder: Path, dna: Any, positions: Any, units: Any, parts: Any) -> dict[str, str]:
    return {}
