# SPDX-License-Identifier: MIT
"""Lists the landmarks of a face: their names in files, and the words for them in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from ...base import toml


@cache
def landmark_words() -> Mapping[str, str]:
    """Landmark name -> its words in sentences; left landmarks precede their right counterparts."""
    out: dict[str, str] = {}
    for name, row in _table().items():
        out[name] = row["words"]
        if name.endswith("_L"):
            out[other_side(name)] = row["words"].replace(" left ", " right ")
    return out


@cache
def needed_landmarks() -> frozenset[str]:
    """Names of the landmarks without which a registration cannot begin."""
    return _those_with("needed")


@cache
def vague_landmarks() -> frozenset[str]:
    """Names of landmarks with an imprecise place on the skin. A registration does not pull vertices
    to them."""
    return _those_with("vague")


def _those_with(key: str) -> frozenset[str]:
    names = {name for name, row in _table().items() if row.get(key)}
    return frozenset(names | {other_side(name) for name in names})


def other_side(name: str) -> str:
    """The name of the same landmark on the other side; a landmark on the midline gives its own
    name."""
    swap = {"_L": "_R", "_R": "_L"}
    return name[:-2] + swap[name[-2:]] if name[-2:] in swap else name


@cache
def _table() -> dict[str, dict[str, str]]:
    return toml.parse(files(__package__).joinpath("names.toml").read_text(encoding="utf-8"))
