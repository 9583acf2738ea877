# SPDX-License-Identifier: GPL-3.0-or-later
"""The visemes that a face brings with it, by which it speaks instead of by ours."""

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
    """The visemes beside a face's DNA file, where author put them, and those of a library.

    What moves a control that the face lacks is another face's.

    Args:
        rig: the face.
        shared: folder of the library; what lies beside the file comes before it.
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
    """The folder of expressions beside a face's DNA file; None where nobody knows the file.

    Args:
        rig: the face.
    """
    source = saved.text(rig, parts.SOURCE)
    if not source:
        return None
    found: Path = native.part("author.input.library").library_folder(Path(bpy.path.abspath(source)))
    return found
