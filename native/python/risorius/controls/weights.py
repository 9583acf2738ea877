# SPDX-License-Identifier: MIT
"""Reads tables of controls and weights from the TOML files of expressions and reactions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..base.errors import ArgumentError
from .regions import expand_sides


def named_weights(
    table: Mapping[str, Any], prefix: str, where: str, lowest: float = 0.0, highest: float = 1.0
) -> dict[str, float]:
    """{control: weight}; a name ending in * gives both sides, one ending in ** the four quarters of
    the lips. If several names give a control, the one with fewer * decides.

    Args:
        table: name -> weight, from a TOML file.
        prefix: prefix of each control in the result.
        where: name of the table in errors.
        lowest, highest: allowed range of a weight.

    Raises:
        ValueError: a weight that is not a number in [lowest, highest].
    """
    out: dict[str, float] = {}
    for name in sorted(table, key=lambda name: -name.count("*")):
        weight = table[name]
        known = isinstance(weight, int | float) and not isinstance(weight, bool)
        if not known or not lowest <= weight <= highest:
            raise ArgumentError(
                f"{where}: {name}: a weight from {lowest:g} to {highest:g} was expected, "
                f"found {weight!r}"
            )
        for control in expand_sides(name):
            out[prefix + control] = float(weight)
    return out
