# SPDX-License-Identifier: MIT
"""Reads the mesh of a Wavefront OBJ file. Vertices keep the file's order."""

from __future__ import annotations

import io
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base import signatures
from ...base.errors import RisoriusError
from ...base.given import MOST, finite_text, shown, whole_text
from ...base.reading import MESH, read_file
from ..geometry.skeleton import Doubles


class ShapeFileError(RisoriusError, ValueError):
    """A file of a mesh or of an expression is unusable."""

    code = "shape_file"


@dataclass
class ObjMesh:
    """Positions, texture coordinates and polygons in the file's order."""

    positions: Doubles  # [V, 3]
    uvs: Doubles  # [T, 2]
    faces: list[list[int]] = field(default_factory=list)  # vertex indices of each polygon
    uv_faces: list[list[int]] = field(default_factory=list)  # indices into uvs of each polygon


def read_obj(path: Path) -> ObjMesh:
    """Read the mesh of an OBJ file. Groups, materials and normals are ignored.

    Raises:
        ShapeFileError: a line of a vertex or polygon is invalid (the message has the number of the
            line), there are no vertices or polygons, or the file has another known format.
        OSError: the file cannot be read.
    """
    positions: list[list[float]] = []
    uvs: list[list[float]] = []
    faces: list[list[int]] = []
    uv_faces: list[list[int]] = []
    refuse_other_kinds(path, "an OBJ")
    for number, line in enumerate(_lines(path), 1):
        kind, _, rest = line.strip().partition(" ")
        try:
            if kind == "v":
                positions.append(_numbers(rest, 3))
            elif kind == "vt":
                uvs.append(_numbers(rest, 2))
            elif kind == "f":
                face, uv_face = _polygon(rest, len(positions), len(uvs))
                faces.append(face)
                uv_faces.append(uv_face)
        except ValueError as error:
            raise ShapeFileError(f"{path}: line {number}: {error}") from None
    if not positions or not faces:
        raise ShapeFileError(f"{path}: vertices and polygons were expected, found none")
    return ObjMesh(np.array(positions), np.array(uvs).reshape(-1, 2), faces, uv_faces)


def choose_mesh(path: Path, what: str, found: Sequence[tuple[int, str, int]], wanted: str) -> int:
    """Choose a mesh of a file. Returns its number.

    Args:
        path: the file, for error messages.
        what: the format's word for blend shapes.
        found: (number, name, number of vertices in blend shapes) of each mesh with blend shapes.
        wanted: name of the mesh; "": the mesh with the most vertices in blend shapes.

    Raises:
        ShapeFileError: there is no mesh with blend shapes, or none with the name.
    """
    if not found:
        raise ShapeFileError(f"{path}: a mesh with {what} was expected, found none")
    if not wanted:
        return max(found, key=lambda row: row[2])[0]
    for number, name, _ in found:
        if name == wanted:
            return number
    names = ", ".join(name for _, name, _ in found)
    raise ShapeFileError(f"{path}: source.mesh: one of {names} was expected, found {wanted}")


def read_positions(path: Path, count: int) -> Doubles:
    """float64[count, 3]: the vertices of an expression's OBJ file.

    Args:
        path: the file.
        count: number of vertices of the neutral mesh.

    Raises:
        ShapeFileError: the number of vertices differs, or a value is no finite number.
        OSError: the file cannot be read.
    """
    refuse_other_kinds(path, "an OBJ")
    positions = []
    for number, line in enumerate(_lines(path), 1):
        if line.startswith("v "):
            try:
                positions.append(_numbers(line[2:], 3))
            except ValueError as error:
                raise ShapeFileError(f"{path}: line {number}: {error}") from None
    if len(positions) != count:
        raise ShapeFileError(
            f"{path}: {count:,} vertices were expected, as the neutral mesh has, "
            f"found {len(positions):,}"
        )
    return np.array(positions)


def refuse_other_kinds(path: Path, expected: str, own: Container[str] = ()) -> None:
    """Reject a file whose bytes show another known format. The message names that format.

    Args:
        path: the file.
        expected: the expected format, for the message.
        own: codes of base.signatures that are accepted.

    Raises:
        ShapeFileError: the file has another format.
    """
    kind = signatures.other_kind(signatures.ends_of(path), own)
    if kind is not None:
        raise ShapeFileError(f"{path}: {expected} was expected, this is {kind}")


def _lines(path: Path) -> Iterator[str]:
    """Yields the lines of a file.

    Raises:
        ReadingError: the file is too large, or is a pipe or a device.
        OSError: the file cannot be read.
    """
    data = read_file(path, MESH, found=True)
    yield from io.TextIOWrapper(io.BytesIO(data), encoding="utf-8", errors="replace")


def _numbers(text: str, count: int) -> list[float]:
    words = text.split()[:count]
    try:
        values = [finite_text(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count:
        raise ValueError(f"{count} finite numbers were expected, found {shown(text.strip())}")
    return values


def _polygon(text: str, vertices: int, uvs: int) -> tuple[list[int], list[int]]:
    face, uv_face = [], []
    for word in text.split():
        parts = word.split("/")
        face.append(_index(parts[0], vertices, "vertex"))
        if len(parts) > 1 and parts[1]:
            uv_face.append(_index(parts[1], uvs, "texture coordinate"))
    if len(face) < 3 or len(uv_face) not in (0, len(face)):
        raise ValueError(f"a polygon of three corners or more was expected, found {shown(text)}")
    return face, uv_face


def _index(text: str, count: int, what: str) -> int:
    """The index from 0 of an OBJ number; negative numbers count from the end.

    Raises:
        ValueError: the index is out of range.
    """
    number = whole_text(text, -MOST)
    index = number - 1 if number > 0 else count + number
    if not 0 <= index < count:
        raise ValueError(f"{what} {number} of {count} is not there")
    return index
