# SPDX-License-Identifier: MIT
"""Finds the meaning of names from several programs: controls or an expression.

Each vocabulary has a table in vocabularies/, next to ARKit's units (arkit.toml). Authoring, clips,
live faces and typed names use this module. A file has a title, a description, `strip` (prefixes
that names may have), `begins` (prefixes that they must have, the usual one first), `ends` (suffixes
that they may have), `matching = "exact"` if letter case counts, `controls` (names that are raw
controls), `same` (names with one meaning) and `names`. The meaning of a name is

- a raw control without prefix, or a list of them. "*" stands for both sides and "**" for the four
  lip quarters. If the name contains "*", it stands for a side, L or Left, in name and meaning;
- "=jawOpen": an ARKit unit;
- "@aa": an expression of the library. In a list with controls, the expression is used only if
  another name of the same head already means one of these controls;
- a table {control, unit or "@expression" = weight}: a shape of the whole face;
- []: a name without meaning, such as Neutral.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from typing import Any

from ..base import toml
from . import arkit
from .regions import expand_sides

PREFIX = "CTRL_expressions."
ARKIT = "arkit"
_ARKIT_STRIP = ("blendShapes.", "blendShape.", "ARKit_", "Face.", "FaceCap_")
_SIDE = re.compile(r"(?:(?<=[a-z])(?=[LR]$)|(?<=[._\- ])(?=[LlRr]$))")
_COPY = re.compile(r"\.\d{3}$")  # suffix that Blender appends to a repeated name
_WORDS = {"L": "Left", "R": "Right"}


@dataclass(frozen=True)
class Meaning:
    """The meaning of a name.

    Attributes:
        vocabulary: name of the vocabulary, one of `names`.
        name: name in the vocabulary's spelling.
        controls: full name of a raw control -> weight; empty if the meaning is an expression of the
            library, or nothing.
        expression: name of an expression; "" for none.
        is_whole: True: a shape of the whole face or a part of it, which is an expression and not a
            control.
        units: ARKit unit -> weight, if the vocabulary uses units.
    """

    vocabulary: str
    name: str
    controls: Mapping[str, float] = field(default_factory=dict)
    expression: str = ""
    is_whole: bool = False
    units: Mapping[str, float] = field(default_factory=dict)


@cache
def loose_name(name: str) -> str:
    """A name in lower case without separators; its side becomes |l or |r at the end.

    eyeBlinkLeft, EyeBlinkLeft, eyeBlink_L, eyeBlinkL and eye_blink_left give the same name.
    """
    name = unicodedata.normalize("NFKC", name)
    match = _SIDE.search(name)
    side = ""
    if match:
        name, side = name[: match.start()], "|" + name[-1].lower()
    plain = re.sub(r"[^\w*]|_", "", name.lower())
    for word in ("left", "right"):
        if not side and plain.endswith(word) and plain != word:
            plain, side = plain[: -len(word)], "|" + word[0]
    return plain + side


class Vocabulary:
    """The names that a program or protocol uses.

    Attributes:
        name: identifier of the vocabulary.
        title: its name for display.
        description: a text for display.
        meanings: name in its usual spelling -> Meaning.
        is_loose: True: letter case, separators such as "_" and the difference of Left and L at the
            end are ignored.
    """

    def __init__(self, name: str, table: Mapping[str, Any]) -> None:
        self.name, self.title = name, str(table["title"])
        self.description = str(table["description"])
        self.is_loose = table.get("matching") != "exact"
        self._strip = tuple(table.get("strip", ()))
        self._begins = tuple(table.get("begins", ()))
        self._ends = tuple(table.get("ends", ()))
        self.meanings = {m.name: m for m in self._read(table)}
        for other, one in table.get("same", {}).items():
            said = self.meanings[one]
            self.meanings[other] = replace(said, name=other)
        self._loose: dict[str, str] = {}
        for spelled in self.meanings:
            self._loose.setdefault(loose_name(spelled), spelled)
        self._loose.pop("", None)

    def _read(self, table: Mapping[str, Any]) -> Iterator[Meaning]:
        first = self._begins[0] if self._begins else ""
        for own in table.get("controls", ()):
            for control in expand_sides(own):
                yield Meaning(self.name, control, {PREFIX + control: 1.0})
        for name, value in table.get("names", {}).items():
            for spelled, said in _for_sides(name, value):
                yield _meaning(self.name, first + spelled, said)

    def spelled(self, name: str, *, loosely: bool = True) -> str | None:
        """A name in the vocabulary's spelling, or None if the vocabulary lacks it.

        Args:
            name: a name; it may have the name of a mesh or figure before it, as in `parts_of`, and
                the vocabulary's prefixes and suffixes.
            loosely: True: ignore differences in spelling, if the vocabulary allows this.
        """
        for candidate in self._candidates(name):
            if candidate in self.meanings:
                return candidate
            if loosely and self.is_loose and (found := self._loose.get(loose_name(candidate))):
                return found
        return None

    def _candidates(self, name: str) -> Iterator[str]:
        for part in parts_of(name):
            for end in ("", *self._ends):
                if not part.endswith(end):
                    continue
                whole = part[: len(part) - len(end)]
                yield whole
                lower = whole.lower()
                for start in (*self._strip, *self._begins):
                    if lower.startswith(start.lower()):
                        first = self._begins[0] if start in self._begins else ""
                        yield first + whole[len(start) :]


def parts_of(name: str) -> list[str]:
    """Forms of a name to look up: as given, and without the name of a mesh or figure before it.

    The name of a mesh or figure ends at the last dot, colon or bar, or at the first double
    underscore. Blender's number of a copy, such as .001, is removed first.
    """
    name = _COPY.sub("", name)
    after = re.split(r"[.:|]", name)[-1] if not name.startswith("CTRL_") else name
    return list(dict.fromkeys(p for p in (name, after, after.partition("__")[2]) if p))


def names() -> tuple[str, ...]:
    """Names of the vocabularies; ARKit is first, because others contain some of its names."""
    return tuple(_all())


def vocabulary(name: str) -> Vocabulary:
    """A vocabulary by its name. Raises: KeyError: not one of `names`."""
    return _all()[name]


def find(name: str, order: Sequence[str] | None = None) -> Meaning | None:
    """The meaning of a name, or None if no vocabulary contains it.

    Args:
        name: name of a shape or a curve; it may have the name of a mesh or figure before it, as in
            `parts_of`.
        order: names of vocabularies, as returned by `leading`; the first that contains the name
            decides. None: ARKit in any spelling, then the exact spelling of any vocabulary, then
            any spelling.
    """
    if order is not None:
        return _found(name, order, loosely=True)
    return (
        _found(name, (ARKIT,), loosely=True)
        or _found(name, names(), loosely=False)
        or _found(name, names(), loosely=True)
    )


def _found(name: str, order: Sequence[str], *, loosely: bool) -> Meaning | None:
    for one in map(vocabulary, order):
        spelled = one.spelled(name, loosely=loosely)
        if spelled is not None:
            return one.meanings[spelled]
    return None


def known(given: Iterable[str]) -> dict[str, int]:
    """Vocabulary -> number of the given names that it contains in any spelling; vocabularies that
    contain none are left out."""
    given = list(given)
    counts = {v.name: sum(v.spelled(n) is not None for n in given) for v in _all().values()}
    return {name: count for name, count in counts.items() if count}


def leading(given: Iterable[str]) -> tuple[str, ...]:
    """The order of vocabularies for looking up a set of names: the one that contains most is first.

    Vocabularies that contain none are left out; ARKit is before others with the same number.
    """
    counts = known(given)
    return tuple(sorted(counts, key=lambda name: -counts[name]))


@cache
def _all() -> dict[str, Vocabulary]:
    units = {unit: "=" + unit for unit in arkit.mapping()}
    table: dict[str, Any] = {"title": "ARKit", "description": "", "names": units}
    found = {ARKIT: Vocabulary(ARKIT, {**table, "strip": _ARKIT_STRIP})}
    folder = resources.files(__package__).joinpath("vocabularies")
    for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
        if entry.name.endswith(".toml"):
            name = entry.name.removesuffix(".toml")
            found[name] = Vocabulary(name, toml.parse(entry.read_text(encoding="utf-8")))
    return found


def _for_sides(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """A row of a vocabulary table, or one row for each side if the name contains a *."""
    if "*" not in name:
        yield name, value
        return
    # EyeClosed* becomes EyeClosedLeft, Eye_Blink_* becomes Eye_Blink_L, and lipFunneler*B becomes
    # lipFunnelerLB.
    is_word = name[0].isupper() and "_" not in name and name.endswith("*")
    for side in "LR":
        yield name.replace("*", _WORDS[side] if is_word else side), _on_side(value, side)


def _on_side(value: Any, side: str) -> Any:
    if isinstance(value, str):
        word = _WORDS[side]
        if value.startswith("@"):
            return value.replace("*", word.lower())
        return value.replace("*", word if value.startswith("=") else side)
    if isinstance(value, list):
        return [_on_side(item, side) for item in value]
    return {_on_side(key, side): share for key, share in value.items()}


def _meaning(vocabulary: str, name: str, value: Any) -> Meaning:
    if isinstance(value, str):
        value = [value]
    is_table = isinstance(value, dict)
    shares = value if is_table else dict.fromkeys(value, 1.0)
    expression = next((key[1:] for key in shares if key.startswith("@")), "")
    controls: dict[str, float] = {}
    units: dict[str, float] = {}
    for key, share in shares.items():
        for part, weight in _controls_of(key, float(share), units).items():
            controls[part] = controls.get(part, 0.0) + weight
    is_whole = bool(expression) and (is_table or not controls)
    return Meaning(vocabulary, name, controls, expression, is_whole, units)


def _controls_of(key: str, share: float, units: dict[str, float]) -> dict[str, float]:
    """Full name of a control -> weight, for one entry of a meaning.

    Args:
        key: the entry: a control without prefix, "=" and an ARKit unit, or "@" and an expression,
            which gives no controls.
        share: weight of the entry.
        units: receives the ARKit units of the entry with their weights.
    """
    if key.startswith("@"):
        return {}
    if not key.startswith("="):
        return {PREFIX + control: share for control in expand_sides(key)}
    base = key[1:]
    named = [base[:-1] + word for word in _WORDS.values()] if base.endswith("*") else [base]
    out: dict[str, float] = {}
    for unit in named:
        units[unit] = units.get(unit, 0.0) + share
        for control, weight in arkit.mapping()[unit].items():
            out[control] = out.get(control, 0.0) + share * weight
    return out
