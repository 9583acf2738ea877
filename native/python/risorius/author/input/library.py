# SPDX-License-Identifier: MIT
"""Makes an expression file for each shape of a face that is a viseme or moves the whole face.

The files belong in a folder next to the face's DNA file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ... import expressions
from ...base.words import counted
from ...expressions import Expression
from .matching import PREFIX, Assignment


def library_folder(dna: Path) -> Path:
    """The folder of a face's expressions, next to its DNA file: anna_expressions for anna.dna."""
    return dna.with_name(dna.stem + "_expressions")


def library_files(became: Assignment, folder: Path) -> dict[Path, bytes]:
    """Path -> bytes of the file for each expression in `became`; expressions.load() reads them.

    Args:
        became: result of matching.assign().
        folder: folder of the library.
    """
    out: dict[Path, bytes] = {}
    for shape, name in became.expressions.items():
        text = expressions.text_of(_expression(name, became.controls[shape]))
        out[folder / f"{name}.toml"] = text.encode()
    return out


def about_library(became: Assignment, folder: Path) -> list[str]:
    """A sentence on the folder of the expressions; an empty list if `became` has no expressions.

    Args:
        became: result of matching.assign().
        folder: folder of the library.
    """
    count = counted(len(became.expressions), "expression")
    return [f"{folder}: {count} of the face itself"] if became.expressions else []


def _expression(name: str, controls: Sequence[str]) -> Expression:
    """An expression that sets a shape's controls, with the default library's label and group; if
    the library lacks the name, the label is made from the name, and the group is "face"."""
    own = expressions.load().get(name)
    weights: Mapping[str, float] = {PREFIX + control: 1.0 for control in controls}
    if own is None:
        return Expression(name, name.replace("_", " ").title(), "face", "", weights)
    return Expression(name, own.label, own.group, own.description, weights, own.regions)
