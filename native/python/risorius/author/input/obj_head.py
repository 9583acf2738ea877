# SPDX-License-Identifier: MIT
"""A folder of OBJ files: the neutral mesh, one file for each expression, and other meshes."""

from __future__ import annotations

import os
from pathlib import Path

from ...controls import vocabulary
from ..heads.parts import HeadPart
from .matching import guess
from .mtl import with_materials
from .obj import ObjMesh, ShapeFileError, read_obj, read_positions

_NEUTRAL = ("neutral", "basis", "base", "rest", "default", "head", "face")


def find_neutral(folder: Path) -> Path:
    """The file of a folder that is the mesh at rest, by its name.

    Raises:
        ShapeFileError: none that is called so.
    """
    files = {path.stem.lower(): path for path in sorted(folder.glob("*.obj"))}
    for word in _NEUTRAL:
        exact = files.get(word)
        named = [path for stem, path in files.items() if word in stem]
        if exact is not None or len(named) == 1:
            return exact or named[0]
    raise ShapeFileError(
        f"{folder}: an OBJ file called {', '.join(_NEUTRAL)} was expected beside those of the "
        f"expressions, found {len(files)} others"
    )


def read_obj_head(neutral: Path, folder: Path, *, others: bool) -> list[HeadPart]:
    """The mesh at rest with its expressions first, then other meshes.

    Args:
        neutral: the file of the mesh at rest.
        folder: of the expressions' files.
        others: whether a file with another number of vertices, whose name is no expression's, is
            another mesh; else it is an error.

    Raises:
        ShapeFileError: a file that cannot be used, or no expressions.
        OSError: a file cannot be read.
    """
    mesh = read_obj(neutral)
    face = HeadPart(neutral.stem, mesh, source=neutral.stem)
    out: list[HeadPart] = []
    for path in sorted(folder.glob("*.obj")):
        if os.path.realpath(path) == os.path.realpath(neutral):  # a loop of links is none
            continue
        if others and not _is_known(path.stem):
            other = _other(path, len(mesh.positions))
            if other is not None:
                out.extend(with_materials(path, HeadPart(path.stem, other, source=path.stem)))
                continue
        face.shapes[path.stem] = read_positions(path, len(mesh.positions)) - mesh.positions
    if not face.shapes:
        raise ShapeFileError(
            f"{folder}: a folder of OBJ files was expected, one for each expression"
        )
    return [*with_materials(neutral, face), *out]


def _is_known(name: str) -> bool:
    return bool(guess(name)) or vocabulary.find(name) is not None


def _other(path: Path, count: int) -> ObjMesh | None:
    """A mesh with another number of vertices; None: it is a shape."""
    mesh = read_obj(path)
    return mesh if len(mesh.positions) != count else None
