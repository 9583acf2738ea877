# SPDX-License-Identifier: MIT
"""Reads the meshes of a head in its rest pose from an OBJ, glTF or FBX file."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ..author.geometry.skeleton import Ints
from ..author.heads.parts import HeadPart, taken_apart
from ..author.input import fbx, gltf
from ..author.input.fbx_head import read_fbx_head
from ..author.input.gltf_head import read_gltf_head
from ..author.input.mtl import with_materials
from ..author.input.obj import read_obj
from ..author.input.spec import BY_BLENDER
from ..author.input.welding import welded
from ..base.reading import MESH, read_file
from .errors import AnyHeadError


def read_head(path: Path) -> tuple[list[HeadPart], str]:
    """The meshes of a head in one space, and the unit of the format, "cm" or "m".

    Args:
        path: an OBJ, glTF, GLB or FBX file, or a folder of OBJ files, one for each mesh.

    Raises:
        AnyHeadError: the file has a format that only Blender imports, or the folder has no OBJ
            files.
        ShapeFileError: a file cannot be used.
        AnimationFileError: a file is damaged.
        OSError: a file cannot be read.
    """
    if path.is_dir():
        files = sorted(path.glob("*.obj"))
        if not files:
            raise AnyHeadError(f"{path}: a folder with OBJ files was expected, found no OBJ file")
        return [part for file in files for part in _obj_parts(file)], "cm"
    suffix = path.suffix.lower()
    if suffix in gltf.SUFFIXES:
        return read_gltf_head(path), "m"
    if suffix == fbx.SUFFIX:
        return read_fbx_head(path), "m"
    if suffix in BY_BLENDER:
        raise AnyHeadError(
            f"{path}: OBJ, glTF, GLB or FBX was expected, found {suffix}: import it into Blender "
            "and choose Object > Make Rig from Head, or save it there as glTF"
        )
    return _obj_parts(path), "cm"


def _obj_parts(path: Path) -> list[HeadPart]:
    """The objects of an OBJ file as parts; a file with fewer than two objects is split only if
    its islands have different materials."""
    mesh = read_obj(path)
    names, of_face, groups = _objects(path)
    known = len(of_face) == len(mesh.faces)
    if len(names) < 2 or not known:
        parts = with_materials(path, HeadPart(path.stem, mesh, source=path.stem))
    else:
        parts = taken_apart(HeadPart(path.stem, mesh, source=path.stem), names, of_face)
        for part in parts:
            part.source, part.polygons = part.name, None
    for name, own in groups.items() if known else ():
        corners = np.concatenate([mesh.faces[f] for f in own])
        parts[0].groups[name] = mesh.positions[np.unique(corners)]
    return [_welded(part) for part in parts]


def _welded(part: HeadPart) -> HeadPart:
    part.mesh, _ = welded(part.mesh, [])
    return part


def _objects(path: Path) -> tuple[list[str], Ints, dict[str, list[int]]]:
    """The distinct names of a file's objects; int64[F]: the object index of each polygon; name of a
    group (line g) -> indices of its polygons."""
    names: dict[str, int] = {}
    groups: dict[str, list[int]] = {}
    rows: list[int] = []
    own, inside = "", list[str]()
    data = io.BytesIO(read_file(path, MESH, found=True))
    for line in io.TextIOWrapper(data, encoding="utf-8", errors="replace"):
        kind, _, rest = line.strip().partition(" ")
        if kind == "o":
            own = rest.strip() or path.stem
        elif kind == "g":
            inside = rest.split()
        elif kind == "f":
            for name in inside:
                groups.setdefault(name, []).append(len(rows))
            rows.append(names.setdefault(own or path.stem, len(names)))
    return list(names), np.array(rows, np.int64), groups
