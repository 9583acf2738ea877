# SPDX-License-Identifier: MIT
"""Tables of control names and weights, as the TOML files of expressions and reactions have them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..base.errors import ArgumentError
from .regions import expand_sides


def named_weights(
    table: Mapping[str, Any], prefix: str, where: str, lowest: float = 0.0, highest: float = 1.0
) -> dict[str, float]:
    """{control: weight} with both sides of what ends in *; a name given in full counts more.

    Args:
        table: name -> weight, out of a TOML file.
        prefix: stands before the name of each control in the result.
        where: what errors call the table.
        lowest, highest: what a weight may be.

    Raises:
        ValueError: a weight that is no number in [lowest, highest].
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
