# SPDX-License-Identifier: MIT
"""Reads expressions (named poses of the standard raw controls) from files that users can edit.

The files in this folder contain six emotions, fifteen visemes and more. Any file of the same format
can be loaded, and `text_of` writes one. A name that ends in * stands for both sides, in ** for the
four lip quarters. A file may state the version of its format: `format = 1`.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base import toml
from ..base.errors import ArgumentError
from ..controls.regions import REGIONS
from ..controls.weights import named_weights

FILES = ("emotions.toml", "visemes.toml", "faces.toml")
EDITION = 2
"""Version of Risorius' own expressions; poses saved with an older version keep their look.

See `get`.
"""
FORMAT = 1
"""Version of the form that text_of writes; newer versions are refused."""
_SAVED = (-1.0, 1.5)  # range of weights in a file with a version, for rotations and overdrive
VISEMES = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U")


@dataclass(frozen=True)
class Expression:
    """A named pose of raw controls."""

    name: str
    label: str
    group: str
    """"emotion", "viseme" or another word of the file, by which pose libraries sort."""
    description: str
    weights: Mapping[str, float]
    """Full name of a raw control -> weight in [0, 1], in saved files [-1, 1.5]; others are 0."""
    regions: tuple[str, ...] = ()
    """Regions whose other controls go to rest; empty for the regions of the weights."""


class Lack(NamedTuple):
    """The controls that an expression uses and that a rig lacks."""

    missing: tuple[str, ...]
    """Controls that the rig lacks."""
    share: float
    """The sum of the weights that the rig can show over the sum of all weights, in [0, 1]."""


def load(path: str | os.PathLike[str] | None = None) -> dict[str, Expression]:
    """Load expressions from a file or a folder.

    Args:
        path: a TOML file, or a folder of TOML files (a library), read in the order of their names;
            None: Risorius' own expressions (emotions, visemes, faces). If several files contain an
            expression of the same name, the last file is used, with a warning.

    Raises:
        ValueError: an invalid file; the message names the file, the expression, the value found and
            the value expected.
        OSError: a file cannot be read.
    """
    if path is None:
        return dict(_own(EDITION))
    if os.path.isdir(path):
        files = sorted(Path(path).glob("*.toml"))
        if not files:
            raise ArgumentError(f"{os.fspath(path)}: a folder with expressions was expected")
        return _joined({os.fspath(file): load(file) for file in files})
    return _parsed(toml.read(path), os.fspath(path))


def of_text(text: str) -> dict[str, Expression]:
    """Read expressions from the text of a file.

    Args:
        text: text of a TOML file.

    Raises:
        ValueError: the text is invalid; the message says where.
    """
    return _parsed(toml.parse(text), "an expression")


def get(name: str, edition: int = EDITION) -> Expression:
    """One of Risorius' own expressions.

    Args:
        name: name of the expression.
        edition: 1 for the older, milder expressions; otherwise the current ones.

    Raises:
        ValueError: unknown name; the message lists some names.
    """
    own = _own(1 if edition == 1 else EDITION)
    if name not in own:
        raise ArgumentError(
            f"{name}: an expression such as {', '.join(list(own)[:6])} was expected"
        )
    return own[name]


def check(
    rig_names: Iterable[str], expressions: Mapping[str, Expression] | None = None
) -> dict[str, Lack]:
    """Find expressions that a rig cannot show completely, with the controls that it lacks.

    Args:
        rig_names: names of the rig's raw controls, Rig.raw_control_names.
        expressions: expressions to check; None for load().
    """
    known = set(rig_names)
    report = {}
    for name, expression in (load() if expressions is None else expressions).items():
        missing = tuple(control for control in expression.weights if control not in known)
        if missing:
            lost = sum(expression.weights[control] for control in missing)
            report[name] = Lack(missing, 1.0 - lost / sum(expression.weights.values()))
    return report


def pose_vector(expression: str | Expression, rig_names: Sequence[str]) -> npt.NDArray[np.float32]:
    """Convert an expression to raw controls of a rig.

    Args:
        expression: an Expression, or the name of one of Risorius' own.
        rig_names: names of the rig's raw controls, Rig.raw_control_names.

    Returns:
        float32[rig_names], 0 for other controls. Controls that the rig lacks are left out.

    Raises:
        ValueError: unknown name.
    """
    if isinstance(expression, str):
        expression = get(expression)
    weights = expression.weights
    return np.array([weights.get(name, 0.0) for name in rig_names], np.float32)


def text_of(expression: Expression) -> str:
    """The text of a TOML file with one expression and the version of the format, for load().

    Raises:
        ValueError: a weight outside [-1, 1.5], or a control whose name ends in *.
    """
    for control, weight in expression.weights.items():
        if not _SAVED[0] <= weight <= _SAVED[1]:
            raise ArgumentError(
                f"{expression.name}: {control}: a weight from {_SAVED[0]:g} to {_SAVED[1]:g} was "
                f"expected, found {weight!r}"
            )
        if control.endswith("*"):
            raise ArgumentError(
                f"{expression.name}: {control}: a name without * at its end was expected"
            )
    key = _quoted(expression.name)
    lines = [
        f"format = {FORMAT}",
        "",
        f"[expressions.{key}]",
        f"label = {_quoted(expression.label)}",
        f"group = {_quoted(expression.group)}",
        f"description = {_quoted(expression.description)}",
        f"regions = [{', '.join(map(_quoted, expression.regions))}]",
        f"[expressions.{key}.weights]",
    ]
    lines += [f"{_quoted(c)} = {float(w)!r}" for c, w in expression.weights.items()]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A TOML string. The JSON encoder escapes the same characters, except DEL, which is
    replaced."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


@cache
def _own(edition: int = EDITION) -> dict[str, Expression]:
    folder = resources.files(__package__)
    if edition == 1:
        folder = folder.joinpath("edition_1")
    texts = {file: folder.joinpath(file).read_text(encoding="utf-8") for file in FILES}
    return _joined({file: _parsed(toml.parse(text), file) for file, text in texts.items()})


def _joined(found: Mapping[str, Mapping[str, Expression]]) -> dict[str, Expression]:
    """Join the expressions of files. For a name in several files, the last file is used."""
    out: dict[str, Expression] = {}
    file_of: dict[str, str] = {}
    for file, expressions in found.items():
        for name in sorted(out.keys() & expressions.keys()):
            warnings.warn(
                f"the expression {name} is in {file_of[name]} and in {file}, which is taken",
                stacklevel=2,
            )
        out |= expressions
        file_of |= dict.fromkeys(expressions, file)
    return out


def _parsed(table: dict[str, Any], where: str) -> dict[str, Expression]:
    number = table.get("format", 0)
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        raise ArgumentError(f"{where}: format: a whole number was expected, found {number!r}")
    if number > FORMAT:
        raise ArgumentError(
            f"{where}: it was written by a newer Risorius: format {FORMAT} at most was expected, "
            f"found {number}"
        )
    prefix, group = table.get("prefix", ""), table.get("group", "")
    rows = table.get("expressions")
    if not isinstance(rows, dict) or not isinstance(prefix, str) or not isinstance(group, str):
        raise ArgumentError(f"{where}: a table of expressions was expected, found {sorted(table)}")
    reach = _SAVED if number else (0.0, 1.0)
    return {name: _expression(name, row, prefix, group, where, reach) for name, row in rows.items()}


def _expression(
    name: str, row: Any, prefix: str, group: str, where: str, reach: tuple[float, float]
) -> Expression:
    place = f"{where}: {name}"
    if not isinstance(row, dict) or not isinstance(row.get("weights"), dict):
        raise ArgumentError(f"{place}: a table with weights was expected, found {row!r}")
    unknown = set(row) - {"label", "group", "description", "weights", "regions"}
    if unknown:
        raise ArgumentError(
            f"{place}: one of the keys label, group, description, regions and weights was "
            f"expected, found {sorted(unknown)[0]}"
        )
    regions = row.get("regions", [])
    strange = regions if not isinstance(regions, list) else [r for r in regions if r not in REGIONS]
    if strange:
        raise ArgumentError(f"{place}: regions such as mouth were expected, found {strange!r}")
    return Expression(
        name,
        str(row.get("label", name)),
        str(row.get("group", group)),
        str(row.get("description", "")),
        named_weights(row["weights"], prefix, place, *reach),
        tuple(regions),
    )
