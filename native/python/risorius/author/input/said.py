# SPDX-License-Identifier: MIT
"""Reads and writes the user's meanings of shapes: the table [controls] of a spec or other file.

A meaning is a raw control without prefix, or a list of raw controls; "=mouthFunnel" stands for the
controls of an ARKit unit, "@aa" for an expression, and [] leaves the shape out. The tables of
controls.vocabulary use the same notation.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from typing import NamedTuple

from ...base import toml
from ...base.given import GivenError, several, shown, text
from ...controls import arkit, vocabulary
from .obj import ShapeFileError

Said = str | list[str]
TABLE = "controls"
_NAME = re.compile(r"[\w-]+")  # names of expressions, which become file names


class SaidMeaning(NamedTuple):
    """The meaning of a shape; if both are empty, the shape is left out.

    Attributes:
        controls: raw controls without prefix.
        expression: name of an expression, or "".
    """

    controls: tuple[str, ...]
    expression: str


def meaning_of(value: Said) -> SaidMeaning:
    """The controls or the expression that an entry of the table [controls] means.

    Raises:
        GivenError: the ARKit unit is unknown, the name of an expression is invalid, or an
            expression is listed together with other meanings.
    """
    given = [value] if isinstance(value, str) else value
    if len(given) == 1 and given[0].startswith("@"):
        name = given[0][1:]
        if not _NAME.fullmatch(name):
            raise GivenError(
                "letters, digits, _ and - were expected in the name of an expression, found "
                f"{shown(name)}"
            )
        return SaidMeaning((), name)
    controls: list[str] = []
    for part in given:
        if part.startswith("@"):
            raise GivenError(
                "an expression alone or controls, but not both, were expected, found "
                f"{shown(given)}"
            )
        controls += _controls(part)
    return SaidMeaning(tuple(dict.fromkeys(controls)), "")


def _controls(part: str) -> list[str]:
    if not part.startswith("="):
        return [part.removeprefix(vocabulary.PREFIX)]
    row = arkit.mapping().get(part[1:])
    if row is None:
        raise GivenError(f"an ARKit unit such as =jawOpen was expected, found {shown(part)}")
    return [name.removeprefix(vocabulary.PREFIX) for name in row]


def check(value: object) -> Said:
    """Check a value of the table [controls] and return it. Raises GivenError if it is invalid."""
    found: Said = list(several(value, of=text)) if isinstance(value, list) else text(value)
    meaning_of(found)
    return found


def read(path: str | os.PathLike[str]) -> dict[str, Said]:
    """Read the table [controls] of a separate file or of a SPEC.toml.

    Raises:
        ShapeFileError: the file is no TOML, lacks the table, or has an invalid entry.
        OSError: the file cannot be read.
    """
    try:
        return parse(toml.text_of(path))
    except (toml.TomlError, GivenError) as error:
        raise ShapeFileError(f"{os.fspath(path)}: {error}") from None


def parse(content: str) -> dict[str, Said]:
    """The table [controls] of a TOML text. Raises TomlError or GivenError."""
    table = toml.parse(content).get(TABLE)
    if not isinstance(table, dict):
        raise GivenError(f"a table [{TABLE}] was expected, as risorius author --names prints it")
    out = {}
    for name, value in table.items():
        try:
            out[name] = check(value)
        except GivenError as error:
            raise GivenError(f"{TABLE}.{name}: {error}") from None
    return out


def row(name: str, value: Said) -> str:
    """The line of the table [controls] for a shape.

    Args:
        name: name of the shape.
        value: its meaning.
    """
    return f"{_quoted(name)} = " + (
        _quoted(value) if isinstance(value, str) else f"[{', '.join(map(_quoted, value))}]"
    )


def text_of(said: Mapping[str, Said]) -> str:
    """The text of a file with the table [controls]. Args: said: shape -> its meaning."""
    return "\n".join([f"[{TABLE}]", *(row(name, value) for name, value in said.items()), ""])


def _quoted(content: str) -> str:
    """A TOML string. Lone surrogates are replaced, because TOML does not allow them."""
    plain = content.encode("utf-8", "replace").decode()
    return json.dumps(plain, ensure_ascii=False).replace("\x7f", "\\u007f")
