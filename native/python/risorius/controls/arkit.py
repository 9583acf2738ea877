# SPDX-License-Identifier: MIT
"""Reads from arkit.toml the raw controls that each of the 52 ARKit units moves, and the order of
the units in protocols."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

from ..base import toml

FULL_SET = 10
"""From this number of ARKit units on, VRM expressions in the same file count as repetitions."""


@cache
def mapping() -> dict[str, dict[str, float]]:
    """ARKit unit -> {full name of a raw control: weight in [0, 1]}; 52 units."""
    table = _table()
    prefix = table["prefix"]
    return {
        unit: {prefix + name: float(weight) for name, weight in row.items()}
        for unit, row in table["units"].items()
    }


@cache
def shares() -> dict[str, str]:
    """Raw control whose value is a fraction of another control -> the other control.

    For example, mouthClose, which keeps the lips together, is a fraction of jawOpen.
    """
    rows = mapping()
    return {
        control: next(iter(rows[whole]))
        for unit, whole in _table()["shares"].items()
        for control in rows[unit]
    }


def order(name: str) -> tuple[str, ...]:
    """The 52 units in the order of a protocol.

    Args:
        name: name of the order: "live_link_face_take", "live_link_face_packet" or "face_cap".

    Raises:
        KeyError: another name.
    """
    table = _table()
    units = tuple(table["units"])
    return tuple(units[index] for index in table["orders"][name])


@cache
def _table() -> dict[str, Any]:
    text = resources.files(__package__).joinpath("arkit.toml").read_text(encoding="utf-8")
    return toml.parse(text)
