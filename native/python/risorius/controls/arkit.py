# SPDX-License-Identifier: MIT
"""The ARKit units in terms of raw controls, read from arkit.toml."""

from __future__ import annotations

from functools import cache
from importlib import resources

from ..base import toml


@cache
def mapping() -> dict[str, dict[str, float]]:
    """ARKit unit -> {raw control name as a DNA spells it: weight in [0, 1]}; 52 units."""
    text = resources.files(__package__).joinpath("arkit.toml").read_text(encoding="utf-8")
    table = toml.parse(text)
    prefix = table["prefix"]
    return {
        unit: {prefix + name: float(weight) for name, weight in row.items()}
        for unit, row in table["units"].items()
    }
