# SPDX-License-Identifier: MIT
"""What a person says that shapes are: the table [controls] of a spec, and files that hold it alone.

A shape is a raw control without prefix, or several; "=mouthFunnel": the controls of an ARKit unit;
"@aa": an expression; []: nothing, it is left out. The tables of controls.vocabulary say the same by
the same signs.
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
_NAME = re.compile(r"[\w-]+")  # of an expression, which becomes the name of a file


class SaidMeaning(NamedTuple):
    """What a shape is; nothing where both are empty.

    Attributes:
        controls: raw controls without prefix.
        expression: its name, or "".
    """

    controls: tuple[str, ...]
    expression: str


def meaning_of(value: Said) -> SaidMeaning:
    """The controls or the expression that a value of the table stands for.

    Raises:
        GivenError: a unit that ARKit lacks, or no name for an expression.
    """
    given = [value] if isinstance(value, str) else value
    if len(given) == 1 and given[0].startswith("@"):
        name = given[0][1:]
        if not _NAME.fullmatch(name):
            raise GivenError(
                f"letters, digits, _ and - were expected of an expression, found {shown(name)}"
            )
        return SaidMeaning((), name)
    controls: list[str] = []
    for part in given:
        if part.startswith("@"):
            raise GivenError(f"an expression alone or controls were expected, found {shown(given)}")
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
    """A value of the table as a file has it. Raises: GivenError: it is none."""
    found: Said = list(several(value, of=text)) if isinstance(value, list) else text(value)
    meaning_of(found)
    return found


def read(path: str | os.PathLike[str]) -> dict[str, Said]:
    """The table [controls] of a file: of one that holds it alone, or of a SPEC.toml.

    Raises:
        ShapeFileError: no TOML, no such table, or an entry that says nothing. OSError.
    """
    try:
        return parse(toml.text_of(path))
    except (toml.TomlError, GivenError) as error:
        raise ShapeFileError(f"{os.fspath(path)}: {error}") from None


def parse(content: str) -> dict[str, Said]:
    """The table [controls] of a text. Raises: TomlError, GivenError: as read."""
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
    """A line of the table.

    Args:
        name: of the shape.
        value: what it is.
    """
    return f"{_quoted(name)} = " + (
        _quoted(value) if isinstance(value, str) else f"[{', '.join(map(_quoted, value))}]"
    )


def text_of(said: Mapping[str, Said]) -> str:
    """The text of a file that holds the table alone. Args: said  by the names of the shapes."""
    return "\n".join([f"[{TABLE}]", *(row(name, value) for name, value in said.items()), ""])


def _quoted(content: str) -> str:
    """A string of TOML, which takes no halves of a character."""
    plain = content.encode("utf-8", "replace").decode()
    return json.dumps(plain, ensure_ascii=False).replace("\x7f", "\\u007f")
