# SPDX-License-Identifier: GPL-3.0-or-later
"""The visemes that come with a face, used for speech instead of those of Risorius."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import bpy

from ... import native
from ..base import parts, saved
from ..base.blender_types import ArmatureObject
from ..character import runtime
from . import library


class Visemes(NamedTuple):
    """Visemes of a face itself.

    Attributes:
        own: risorius.expressions.Expression by the names of visemes.
        troubles: a sentence for each file that cannot be used.
    """

    own: Mapping[str, native.Expression]
    troubles: list[str]


def of(rig: ArmatureObject, shared: Path) -> Visemes:
    """The visemes of a face: beside its DNA file, where `author` writes them, and in a library.

    A viseme with a control that the face lacks belongs to another face and is left out.

    Args:
        rig: the face.
        shared: folder of the library; visemes beside the file take precedence.
    """
    known, names = set(runtime.there(rig).labels), native.part("expressions").VISEMES
    own: dict[str, native.Expression] = {}
    troubles: list[str] = []
    for folder in (shared, beside(rig)):
        if folder is None or not folder.is_dir():
            continue
        found, odd = library.of_folder(folder)
        mine = [one for _, one in found if one.name in names and one.weights]
        own |= {one.name: one for one in mine if known.issuperset(one.weights)}
        troubles += odd
    return Visemes(own, troubles)


def beside(rig: ArmatureObject) -> Path | None:
    """The folder of expressions beside a face's DNA file; None if the file is unknown.

    Args:
        rig: the face.
    """
    source = saved.text(rig, parts.SOURCE)
    if not source:
        return None
    found: Path = native.part("author.input.library").library_folder(Path(bpy.path.abspath(source)))
    return found
