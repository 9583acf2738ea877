# SPDX-License-Identifier: MIT
"""All meshes of a binary FBX, each where its node stands."""

from __future__ import annotations

from pathlib import Path

from ..heads.parts import HeadPart
from . import fbx
from .obj import ShapeFileError


def read_fbx_head(path: Path) -> list[HeadPart]:
    """The meshes of an FBX, in metres, y up.

    Args:
        path: of the file.

    Raises:
        ShapeFileError: no mesh, or another kind of file.
        AnimationFileError: the file is damaged; with the place in it.
        BudgetError: more numbers than a file of this size may hold.
    """
    scene = fbx.open_scene(path)
    out: list[HeadPart] = []
    for number, name in fbx.meshes_of(scene):
        source, again = name or f"mesh{number}", 1
        while source in {part.source for part in out}:
            again += 1
            source = f"{name}.{again}"
        out.append(HeadPart(source, *fbx.mesh_of(scene, number), source=source))
    if not out:
        raise ShapeFileError(f"{path}: a mesh with blend shapes was expected, found none")
    return out
