# SPDX-License-Identifier: MIT
"""Reads from TOML the reactions of a Mixer and the rules of controls that exclude each other."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import toml
from ..base.errors import ArgumentError
from ..controls.regions import expand_sides
from ..controls.weights import named_weights

Index = Mapping[str, int]
_Part = tuple[npt.NDArray[np.uint32], npt.NDArray[np.float32], float, float, float, float]
_Yield = tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32], str, float]


@dataclass(frozen=True)
class ReactionPart:
    """Controls of a reaction with one envelope: delay, attack, hold and release in seconds."""

    weights: Mapping[str, float]
    """Control -> share of the way to 1 (or to its upper limit, if lower) at the peak, in [0, 1]."""
    delay: float = 0.0
    """Seconds from the firing to the start of the attack."""
    attack: float = 0.1
    hold: float = 0.0
    release: float = 0.3


@dataclass(frozen=True)
class Reaction:
    """A movement that ends by itself; it rises and falls along the curve x * x * (3 - 2 * x) for x
    from 0 to 1."""

    name: str
    parts: tuple[ReactionPart, ...]
    label: str = ""
    description: str = ""

    @property
    def duration(self) -> float:
        """Seconds from the start of the reaction until its effect on all controls has ended."""
        return max((p.delay + p.attack + p.hold + p.release for p in self.parts), default=0.0)

    def parts_of(self, index: Index) -> list[_Part]:
        """The parts as the native mixer expects them. Controls that the face lacks are left out."""
        out = []
        for p in self.parts:
            there = {index[name]: weight for name, weight in p.weights.items() if name in index}
            controls = np.array(list(there), np.uint32)
            weights = np.array(list(there.values()), np.float32)
            out.append((controls, weights, p.delay, p.attack, p.hold, p.release))
        return out


@dataclass(frozen=True)
class Yield:
    """A rule: active controls `by` weaken each control in `of` by a factor.

    The factor is 1 - amount * m, where m is the maximum, minimum or mean (see `measure`) of the
    values of the controls `by`.
    """

    name: str
    by: tuple[str, ...]
    of: tuple[str, ...]
    measure: str = "max"
    """ "max", "min" or "mean" of `by`, each first clamped to [0, 1]."""
    amount: float = 1.0


@dataclass(frozen=True)
class Exclusives:
    """Rules of controls that exclude each other."""

    yields: tuple[Yield, ...] = ()
    opposites: tuple[tuple[str, str], ...] = field(default=())
    """Pairs; the common amount is subtracted from both."""

    def rules_of(self, index: Index) -> tuple[list[_Yield], list[tuple[int, int]]]:
        """The rules as the native mixer expects them. Controls that the face lacks are left out."""

        def there(names: tuple[str, ...]) -> npt.NDArray[np.uint32]:
            return np.array([index[name] for name in names if name in index], np.uint32)

        yields = [(there(y.by), there(y.of), y.measure, y.amount) for y in self.yields]
        pairs = [(index[a], index[b]) for a, b in self.opposites if a in index and b in index]
        return [y for y in yields if len(y[0]) and len(y[1])], pairs


def load_reactions(path: str | os.PathLike[str] | None = None) -> dict[str, Reaction]:
    """Reactions by name, from a file such as risorius/anim/reactions.toml, which is the default.

    Raises:
        OSError: the file cannot be read.
        ValueError: invalid file; the message names the file, the value found and the one expected.
    """
    table, where = _read(path, "reactions.toml")
    prefix = table.get("prefix", "")
    rows = {name: row for name, row in table.items() if name != "prefix"}
    return {name: _reaction(name, row, prefix, where) for name, row in rows.items()}


def load_exclusives(path: str | os.PathLike[str] | None = None) -> Exclusives:
    """Rules from a file such as risorius/anim/exclusives.toml, which is the default.

    Raises:
        OSError: the file cannot be read.
        ValueError: invalid file; the message names the file, the value found and the one expected.
    """
    table, where = _read(path, "exclusives.toml")
    prefix = table.get("prefix", "")
    try:
        yields = tuple(
            Yield(
                row.get("name", ""),
                _names(row["by"], prefix),
                _names(row["of"], prefix),
                row.get("measure", "max"),
                float(row.get("amount", 1.0)),
            )
            for row in table.get("yields", [])
        )
        rows = table.get("opposites", {}).get("pairs", [])
        pairs = tuple((prefix + a, prefix + b) for a, b in rows)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ArgumentError(
            f"{where}: tables of yields with by and of, and pairs of opposites were expected: "
            f"{error!r}"
        ) from None
    return Exclusives(yields, pairs)


def _read(path: str | os.PathLike[str] | None, own: str) -> tuple[dict[str, Any], str]:
    return (_own(own), own) if path is None else (toml.read(path), os.fspath(path))


@cache
def _own(file: str) -> dict[str, Any]:
    """Read a TOML file of this package. The result is cached, because each new mixer needs it."""
    text = resources.files(__package__).joinpath(file).read_text(encoding="utf-8")
    return toml.parse(text)


def _names(names: list[str], prefix: str) -> tuple[str, ...]:
    return tuple(prefix + full for name in names for full in expand_sides(name))


def _reaction(name: str, row: Any, prefix: str, where: str) -> Reaction:
    if not isinstance(row, dict) or not row.get("parts"):
        raise ArgumentError(f"{where}: {name}: a table with parts was expected, found {row!r}")
    parts = []
    for number, part in enumerate(row["parts"]):
        place = f"{where}: {name}.parts[{number}]"
        times = {key: part[key] for key in ("delay", "attack", "hold", "release") if key in part}
        for key, seconds in times.items():
            lowest = "above 0" if key in ("attack", "release") else "of 0 or more"
            number_given = isinstance(seconds, int | float) and not isinstance(seconds, bool)
            if not number_given or seconds < 0 or (lowest == "above 0" and seconds == 0):
                raise ArgumentError(
                    f"{place}.{key}: seconds {lowest} were expected, found {seconds!r}"
                )
        unknown = set(part) - set(times) - {"weights"}
        if unknown or not part.get("weights"):
            found = sorted(unknown)[0] if unknown else "no weights"
            raise ArgumentError(
                f"{place}: delay, attack, hold, release and weights were expected, found {found}"
            )
        parts.append(ReactionPart(named_weights(part["weights"], prefix, place), **times))
    return Reaction(name, tuple(parts), row.get("label", name), row.get("description", ""))
