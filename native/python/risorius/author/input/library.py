# SPDX-License-Identifier: MIT
"""The expressions that a face brings with it: a library of its own, as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ... import expressions
from ...base.words import counted
from ...expressions import Expression
from .matching import PREFIX, Assignment


def library_folder(dna: Path) -> Path:
    """Where the library of a face lies: beside its DNA file, anna_expressions for anna.dna."""
    return dna.with_name(dna.stem + "_expressions")


def library_files(became: Assignment, folder: Path) -> dict[Path, bytes]:
    """A file for each expression that a shape became, in the form that expressions.load reads.

    Args:
        became: of matching.assign.
        folder: of the library.
    """
    out: dict[Path, bytes] = {}
    for shape, name in became.expressions.items():
        text = expressions.text_of(_expression(name, became.controls[shape]))
        out[folder / f"{name}.toml"] = text.encode()
    return out


def about_library(became: Assignment, folder: Path) -> list[str]:
    """A sentence that says where the expressions are, none where there are none.

    Args:
        became: of matching.assign.
        folder: of the library.
    """
    count = counted(len(became.expressions), "expression")
    return [f"{folder}: {count} of the face itself"] if became.expressions else []


def _expression(name: str, controls: Sequence[str]) -> Expression:
    """An expression that is one shape; what it is called and where it belongs is as in our own."""
    own = expressions.load().get(name)
    weights: Mapping[str, float] = {PREFIX + control: 1.0 for control in controls}
    if own is None:
        return Expression(name, name.replace("_", " ").title(), "face", "", weights)
    return Expression(name, own.label, own.group, own.description, weights, own.regions)
