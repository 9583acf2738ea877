# SPDX-License-Identifier: MIT
"""Reads the materials of an OBJ file from its MTL files, and assigns them to polygons."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from ...base.given import finite_text
from ...base.reading import MESH, ReadingError, read_file
from ...importing.errors import AnimationFileError
from ...importing.source import read_bytes
from ..geometry.skeleton import Ints
from ..heads.islands import divided
from ..heads.parts import HeadPart, Material, as_stored

_ROLES = {"map_kd": "color", "norm": "normal", "map_pr": "roughness"}


def with_materials(path: Path, part: HeadPart) -> list[HeadPart]:
    """Divide the mesh of an OBJ file by materials: each connected piece gets the material of most
    of its polygons, see islands.divided().

    Args:
        path: the OBJ file.
        part: the mesh of the file.
    """
    used: list[str] = []
    rows: list[int] = []
    files: list[str] = []
    for line in _lines(path):
        kind, _, rest = line.strip().partition(" ")
        if kind == "mtllib":
            files.append(rest.strip())
        elif kind == "usemtl":
            used.append(rest.strip())
        elif kind == "f":
            rows.append(len(used) - 1)
    if not used or not files:
        return [part]
    known: dict[str, Material] = {}
    for file in dict.fromkeys(files):
        _read(path, file, known)
    order = list(dict.fromkeys(used))
    of_use = np.array([order.index(name) for name in used])
    of_face: Ints = of_use[np.maximum(rows, 0)]
    looks = [known.get(name) or Material(name) for name in order]
    looks[0].notes.extend(known[""].notes if "" in known else ())
    return divided(part, of_face, looks)


def _lines(path: Path) -> list[str]:
    data = read_file(path, MESH, found=True)
    return list(io.TextIOWrapper(io.BytesIO(data), encoding="utf-8", errors="replace"))


def _read(path: Path, file: str, out: dict[str, Material]) -> None:
    """Read an MTL file.

    Args:
        path: path of the OBJ file.
        file: name of the MTL file in the OBJ file.
        out: receives the materials by name. If the MTL file cannot be read, it receives a material
            with the name "" that has only a note for the user.
    """
    material = Material(file)
    try:
        if not _is_near(file):
            raise OSError("a material file in the folder of the OBJ file was expected")
        lines = _lines(path.parent / file)
    except (OSError, ReadingError) as error:
        material.notes.append(f"{file}: the materials are left out: {error}")
        out[""] = material
        return
    for line in lines:
        kind, _, rest = line.strip().partition(" ")
        if kind == "newmtl":
            material = out[rest.strip()] = Material(rest.strip())
        elif kind == "Kd":
            try:
                values = [finite_text(word) for word in rest.split()[:3]]
            except ValueError:
                continue
            if len(values) == 3:
                material.color = as_stored([*values, 1.0])
        elif kind.lower() in _ROLES and rest.split():
            _add_picture(path, re.sub(r"^(-\w+ +[\d.+ -]+)+", "", rest.strip()), kind, material)


def _is_near(file: str) -> bool:
    """Whether a path stays in the OBJ's folder or below. Other files must not be read."""
    return not (re.match(r"[a-zA-Z]+:|[/\\]", file) or ".." in re.split(r"[/\\]", file))


def _add_picture(path: Path, file: str, kind: str, out: Material) -> None:
    role, name = _ROLES[kind.lower()], file.replace("\\", "/")
    name = name if _is_near(name) else name.rpartition("/")[2]
    try:
        out.pictures[role] = read_bytes(path.parent / name, found=True)
    except AnimationFileError as error:
        out.notes.append(f"{out.name}: its {role} texture is left out: {error}")
