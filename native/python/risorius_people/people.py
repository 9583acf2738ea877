# SPDX-License-Identifier: MIT
"""The sample people, defined by weights of shapes (age, build, origin, features) and colours."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from risorius.base import toml
from risorius.base.errors import ArgumentError
from risorius.base.given import GivenError, finite, shown

Colour = tuple[float, float, float]
ORIGINS = ("caucasian", "african", "asian")
YEARS = (5.0, 90.0)  # youngest and oldest age
# (age in years, age group of the data): at this age a face has only the shapes of this group, and
# between two ages a mix of both groups.
_AGES = ((1.0, "baby"), (11.0, "child"), (20.0, "young"), (32.0, "young"), (90.0, "old"))
HAIR_STYLES = ("none", "crop", "receding", "long", "bun", "afro")
BEARD_STYLES = ("none", "full", "short", "goatee", "moustache")
_OPTIONAL: tuple[str, ...] = (
    "muscle",
    "weight",
    "features",
    "asymmetry",
    "freckles",
    "scalp",
    "shirt",
)
_OPTIONAL += ("hair_length", "hair_curl", "hair_grey", "hair_fringe")
_OPTIONAL += ("hair_style", "beard_style")
_COLOURS = ("skin", "flush", "lids", "lips", "hair", "brows", "shirt")


@dataclass(frozen=True)
class Person:
    """The definition of a sample person; cast.toml explains it. Colours are sRGB in [0, 1]."""

    name: str
    gender: str
    age: int
    origin: dict[str, float]
    skin: Colour
    flush: Colour
    lids: Colour
    lips: Colour
    hair: Colour
    brows: Colour
    beard: float
    iris: tuple[Colour, Colour]
    """(colour at the pupil, colour at the rim)."""
    shirt: Colour = (0.22, 0.24, 0.28)
    muscle: float = 0.5
    weight: float = 0.5
    freckles: float = 0.0
    scalp: float = 0.9
    features: dict[str, float] = field(default_factory=dict)
    asymmetry: dict[str, float] = field(default_factory=dict)
    """Name of an asymmetry shape -> weight, from -1 (right side) to 1 (left side)."""
    hair_style: str = "crop"
    hair_length: float = 1.0
    hair_curl: float = 0.0
    hair_grey: float = 0.0
    hair_fringe: float = 0.0
    beard_style: str = "none"

    def shape(self) -> dict[str, float]:
        """Name of a body shape of the data -> weight, without the shapes in `features`."""
        ages: dict[str, float] = {}
        for (low, young), (high, old) in itertools.pairwise(_AGES):
            if low <= self.age <= high:
                up = (self.age - low) / (high - low)
                ages = {}
                for name, share in ((young, 1 - up), (old, up)):
                    ages[name] = ages.get(name, 0.0) + share
                break
        out: dict[str, float] = {}
        for age, part in ages.items():
            for muscle, strong in _levels("muscle", self.muscle):
                for weight, heavy in _levels("weight", self.weight):
                    name = f"macrodetails/universal-{self.gender}-{age}-{muscle}-{weight}"
                    out[name] = part * strong * heavy
        for origin, share in self.origin.items():
            for age, part in ages.items():
                out[f"macrodetails/{origin}-{self.gender}-{age}"] = share * part
        return {name: weight for name, weight in out.items() if weight}


def _levels(what: str, value: float) -> list[tuple[str, float]]:
    low, high = ("min", "average") if value <= 0.5 else ("average", "max")
    up = 2 * value if value <= 0.5 else 2 * value - 1
    return [(f"{low}{what}", 1 - up), (f"{high}{what}", up)]


class _Reader:
    """Reads the values of a person's table; an invalid value raises an error with its TOML key."""

    def __init__(self, where: str, table: dict[str, Any]) -> None:
        self.where, self.table = where, dict(table)

    def fail(self, key: str, expected: str, found: object) -> ArgumentError:
        return ArgumentError(f"{self.where}: {key}: {expected} was expected, found {shown(found)}")

    def take(self, key: str, convert: Callable[[str, Any], Any]) -> dict[str, Any]:
        return {key: convert(key, self.table.pop(key))} if key in self.table else {}

    def number(self, low: float, high: float) -> Callable[[str, Any], float]:
        def convert(key: str, value: Any) -> float:
            try:
                return finite(value, low, high)
            except GivenError:
                raise self.fail(key, f"a number from {low:g} to {high:g}", value) from None

        return convert

    def age(self, key: str, value: Any) -> int:
        return round(self.number(*YEARS)(key, value))

    def text(self, key: str, value: Any) -> str:
        if not isinstance(value, str) or not value.isidentifier():
            raise self.fail(key, "letters and digits, a letter first,", value)
        return value

    def one_of(self, names: tuple[str, ...]) -> Callable[[str, Any], str]:
        def convert(key: str, value: Any) -> str:
            if value not in names:
                raise self.fail(key, f"one of {', '.join(names)}", value)
            return str(value)

        return convert

    def gender(self, key: str, value: Any) -> str:
        if value not in ("female", "male"):
            raise self.fail(key, '"female" or "male"', value)
        return str(value)

    def shares(self, key: str, value: Any, low: float = 0) -> dict[str, float]:
        if not isinstance(value, dict):
            raise self.fail(key, "a table", value)
        return {name: self.number(low, 1)(f"{key}.{name}", x) for name, x in value.items()}

    def sided(self, key: str, value: Any) -> dict[str, float]:
        return self.shares(key, value, -1)

    def origin(self, key: str, value: Any) -> dict[str, float]:
        out = self.shares(key, value)
        unknown = [name for name in out if name not in ORIGINS]
        if unknown:
            raise self.fail(key, f"a share of {', '.join(ORIGINS)}", unknown[0])
        if abs(sum(out.values()) - 1) > 1e-3:
            raise self.fail(key, "shares that are 1 together", round(sum(out.values()), 3))
        return out

    def colour(self, key: str, value: Any) -> Colour:
        if not isinstance(value, list) or len(value) != 3:
            raise self.fail(key, "three numbers from 0 to 1", value)
        red, green, blue = (self.number(0, 1)(key, x) for x in value)
        return red, green, blue

    def iris(self, key: str, value: Any) -> tuple[Colour, Colour]:
        if not isinstance(value, list) or len(value) != 2:
            raise self.fail(key, "a colour at the pupil and one at the rim", value)
        return self.colour(key, value[0]), self.colour(key, value[1])


def _person(where: str, table: dict[str, Any], like: Person | None) -> Person:
    """Reads a person from a TOML table.

    Args:
        where: name of the table in errors.
        table: the person's table.
        like: a person whose values are used for missing keys, or None.

    Raises:
        ValueError: an unknown key, an invalid value, or a missing key; the text names the key.
    """
    read = _Reader(where, table)
    values: dict[str, Any] = dict(vars(like)) if like else {}
    values |= read.take("name", read.text) | read.take("gender", read.gender)
    values |= read.take("age", read.age) | read.take("origin", read.origin)
    values |= read.take("features", read.shares) | read.take("iris", read.iris)
    values |= read.take("asymmetry", read.sided)
    for key in ("muscle", "weight", "beard", "freckles", "scalp"):
        values |= read.take(key, read.number(0, 1))
    for key in ("hair_curl", "hair_grey", "hair_fringe"):
        values |= read.take(key, read.number(0, 1))
    values |= read.take("hair_length", read.number(0.3, 2))
    values |= read.take("hair_style", read.one_of(HAIR_STYLES))
    values |= read.take("beard_style", read.one_of(BEARD_STYLES))
    for key in _COLOURS:
        values |= read.take(key, read.colour)
    if read.table:
        raise ArgumentError(f"{where}: {next(iter(read.table))}: a person has no such key")
    needed = [k for k, f in Person.__dataclass_fields__.items() if k not in values]
    needed = [k for k in needed if k not in _OPTIONAL]
    if needed:
        raise ArgumentError(f"{where}: {needed[0]} is missing, and no `like` has it")
    return Person(**values)


def _cast() -> dict[str, Person]:
    text = files(__package__).joinpath("cast.toml").read_text(encoding="utf-8")
    return {key: _person(f"cast.toml, {key}", t, None) for key, t in toml.parse(text).items()}


PEOPLE = _cast()
MAN = PEOPLE["man"]


def read_person(path: Path) -> Person:
    """Reads a person from a TOML file.

    Args:
        path: path of the file; cast.toml explains its TOML keys.

    Raises:
        OSError: the file cannot be read.
        ValueError: not TOML, an unknown or missing TOML key, or an invalid value.
    """
    table = toml.read(path)
    like = table.pop("like", None)
    if like is not None and not (isinstance(like, str) and like in PEOPLE):
        raise ArgumentError(
            f"{path}: like: one of {', '.join(PEOPLE)} was expected, found {shown(like)}"
        )
    return _person(str(path), table, PEOPLE[like] if like else None)
