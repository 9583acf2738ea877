# SPDX-License-Identifier: MIT
"""The ARKit units as raw controls, and in the orders of protocols; read from arkit.toml."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

from ..base import toml

FULL_SET = 10
"""With at least this many ARKit units, VRM expressions in the same file count as repetitions."""


@cache
def mapping() -> dict[str, dict[str, float]]:
    """ARKit unit -> {raw control in the spelling of a DNA: weight in [0, 1]}; 52 units."""
    table = _table()
    prefix = table["prefix"]
    return {
        unit: {prefix + name: float(weight) for name, weight in row.items()}
        for unit, row in table["units"].items()
    }


@cache
def shares() -> dict[str, str]:
    """Raw control that takes back a share of another control -> that control; see
    `shares.share_of`."""
    rows = mapping()
    return {
        control: next(iter(rows[whole]))
        for unit, whole in _table()["shares"].items()
        for control in rows[unit]
    }


def order(name: str) -> tuple[str, ...]:
    """The 52 units in the order of a protocol.

    Args:
        name: "live_link_face_take", "live_link_face_packet" or "face_cap".
    """
    table = _table()
    units = tuple(table["units"])
    return tuple(units[index] for index in table["orders"][name])


@cache
def _table() -> dict[str, Any]:
    text = resources.files(__package__).joinpath("arkit.toml").read_text(encoding="utf-8")
    return toml.parse(text)
