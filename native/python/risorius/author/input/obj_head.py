# SPDX-License-Identifier: MIT
"""Reads a folder of OBJ files: the neutral mesh, a file for each expression, and other meshes."""

from __future__ import annotations

import os
from pathlib import Path

from ...controls import vocabulary
from ..heads.parts import HeadPart
from .matching import guess
from .mtl import with_materials
from .obj import ObjMesh, ShapeFileError, read_obj, read_positions
from .welding import welded

_NEUTRAL = ("neutral", "basis", "base", "rest", "default", "head", "face")


def find_neutral(folder: Path) -> Path:
    """Find the file of the neutral mesh in a folder by its name.

    The words neutral, basis, base, rest, default, head and face are tried in this order. A word
    finds the file with this name, or else the only file with the word in its name.

    Raises:
        ShapeFileError: no word finds a file.
    """
    files = {path.stem.lower(): path for path in sorted(folder.glob("*.obj"))}
    for word in _NEUTRAL:
        exact = files.get(word)
        named = [path for stem, path in files.items() if word in stem]
        if exact is not None or len(named) == 1:
            return exact or named[0]
    raise ShapeFileError(
        f"{folder}: an OBJ file called {', '.join(_NEUTRAL)} was expected beside the OBJ files of "
        f"the expressions, found {len(files)} other files"
    )


def read_obj_head(neutral: Path, folder: Path, *, others: bool) -> list[HeadPart]:
    """Read the neutral mesh with its expressions, and other meshes. The neutral mesh is the first.

    Args:
        neutral: file of the neutral mesh.
        folder: folder of the expressions' files.
        others: True takes a file as another mesh if its number of vertices differs and its name is
            no known expression. False makes this an error.

    Raises:
        ShapeFileError: a file is unusable, or there are no expressions.
        OSError: a file cannot be read.
    """
    mesh = read_obj(neutral)
    face = HeadPart(neutral.stem, mesh, source=neutral.stem)
    out: list[HeadPart] = []
    for path in sorted(folder.glob("*.obj")):
        if os.path.realpath(path) == os.path.realpath(neutral):  # does not raise for link loops
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
    face.mesh, moved = welded(mesh, list(face.shapes.values()))
    face.shapes = dict(zip(face.shapes, moved, strict=True))
    return [*with_materials(neutral, face), *out]


def _is_known(name: str) -> bool:
    return bool(guess(name)) or vocabulary.find(name) is not None


def _other(path: Path, count: int) -> ObjMesh | None:
    """The mesh of a file whose number of vertices is not `count`; None for a file with `count`
    vertices, which is a shape."""
    mesh = read_obj(path)
    return mesh if len(mesh.positions) != count else None
