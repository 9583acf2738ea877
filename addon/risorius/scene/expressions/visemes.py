# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds visemes that were made for a face; speech uses them instead of the built-in visemes."""

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
    """Visemes that were made for a face.

    Attributes:
        own: viseme name -> expression.
        troubles: a sentence for each unusable file.
    """

    own: Mapping[str, native.Expression]
    troubles: list[str]


def of(rig: ArmatureObject, shared: Path) -> Visemes:
    """The visemes of a face from the folder near its DNA file and from a library.

    Visemes with a control that the face lacks are left out, because they belong to another face.

    Args:
        rig: the face.
        shared: folder of the library; visemes near the DNA file take precedence.
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
    """The folder near a face's DNA file in which rig authoring stores expressions.

    None if the path of the DNA file is unknown.

    Args:
        rig: the face.
    """
    source = saved.text(rig, parts.SOURCE)
    if not source:
        return None
    found: Path = native.part("author.input.library").library_folder(Path(bpy.path.abspath(source)))
    return found
