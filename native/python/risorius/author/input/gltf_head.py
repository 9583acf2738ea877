# SPDX-License-Identifier: MIT
"""Reads all meshes of a glTF at the places of their nodes, and divides them by their materials."""

from __future__ import annotations

import base64
import binascii
import copy
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from ...base.errors import RisoriusError
from ...base.given import shown
from ...importing.errors import AnimationFileError
from ...importing.gltf import Document
from ...importing.source import read_bytes
from ..geometry.skeleton import Doubles
from ..heads.islands import divided
from ..heads.parts import HeadPart, Material, as_stored
from . import gltf
from .obj import ShapeFileError

_KINDS = {"image/png": ".png", "image/jpeg": ".jpg", "image/webp": ".webp"}


def read_gltf_head(path: Path) -> list[HeadPart]:
    """Read the meshes of a glTF, in metres with y up.

    Primitives that are not lists of triangles are left out.

    Args:
        path: the file.

    Raises:
        ShapeFileError: the file is no glTF or contains no triangles.
        AnimationFileError: the file is damaged; the message names the place.
        BudgetError: the file contains more numbers than its size allows.
    """
    document = gltf.open_document(path)
    rows = document.json.get("meshes")
    out: list[HeadPart] = []
    materials: dict[int, Material] = {}
    for number, row in enumerate(rows if isinstance(rows, list) else []):
        if not isinstance(row, dict):
            raise document.fail(f"meshes[{number}]", f"a table was expected, found {shown(row)}")
        for name, turn in _places(document, number, row):
            source = _free(name, {part.source for part in out})
            own = _parts(document, number, source, materials)
            if own:
                own[0].groups = gltf.groups_of(document, number)
            out.extend(_placed(part, turn) for part in own)
    if not out:
        raise ShapeFileError(f"{path}: a mesh with morph targets was expected, found none")
    return out


def _free(name: str, taken: set[str]) -> str:
    number, out = 1, name
    while out in taken:
        number += 1
        out = f"{name}.{number}"
    return out


def _places(document: Document, number: int, row: Mapping[str, Any]) -> list[tuple[str, Doubles]]:
    """For each node that shows mesh `number`: its name, and the matrix float64[4, 4] from the first
    of these nodes to this node. Skinned or unused meshes give one entry with the identity. A single
    entry has the mesh's name."""
    nodes = document.json.get("nodes")
    rows = nodes if isinstance(nodes, list) else []
    own = gltf.name_of(document, row, number)
    found = [n for n, x in enumerate(rows) if isinstance(x, dict) and x.get("mesh") == number]
    skinned = [n for n in found if "skin" in rows[n]]
    free = [n for n in found if "skin" not in rows[n]]
    if not found or skinned:  # skinned meshes follow their joints instead of their nodes
        return [(own, np.eye(4))]
    first = gltf.world_matrix(document, free[0])
    out = [(own, np.eye(4))]
    for node in free[1:]:
        if abs(np.linalg.det(first[:3, :3])) > 1e-30:
            turn = gltf.world_matrix(document, node) @ np.linalg.inv(first)
            out.append((str(rows[node].get("name") or own), turn))
    if len(out) > 1:
        out[0] = (str(rows[free[0]].get("name") or own), out[0][1])
    return out


def _placed(part: HeadPart, turn: Doubles) -> HeadPart:
    if not np.array_equal(turn, np.eye(4)):
        part.mesh.positions = part.mesh.positions @ turn[:3, :3].T + turn[:3, 3]
        part.shapes = {name: delta @ turn[:3, :3].T for name, delta in part.shapes.items()}
        if np.linalg.det(turn[:3, :3]) < 0:
            part.mesh.faces = [face[::-1] for face in part.mesh.faces]
            part.mesh.uv_faces = [face[::-1] for face in part.mesh.uv_faces]
    return part


def _parts(
    document: Document, number: int, source: str, materials: dict[int, Material]
) -> list[HeadPart]:
    """The parts of a mesh: each connected piece gets the material of most of its polygons, and the
    pieces of a material form a part, see islands.divided()."""
    row = document.json["meshes"][number]
    groups: dict[int, list[dict[str, Any]]] = {}
    for primitive in gltf.primitives(document, row, number):
        kind = primitive.get("material")
        if primitive.get("mode", 4) == 4:  # lists of triangles; strips, lines, points are left out
            groups.setdefault(kind if isinstance(kind, int) else -1, []).append(primitive)
    if not groups:
        return []
    everything = [primitive for group in groups.values() for primitive in group]
    mesh, shapes = gltf.assembled(_only(document, number, everything), number)
    part = HeadPart(source, mesh, shapes, source=source)
    looks = [_material(document, kind, materials) for kind in groups]
    if len(looks) < 2:
        part.material = looks[0]
        return [part]
    counts = [
        len(gltf.assembled(_only(document, number, group), number)[0].faces)
        for group in groups.values()
    ]
    of_face = np.repeat(np.arange(len(counts)), counts)
    return divided(part, of_face, [look or Material("other") for look in looks])


def _only(document: Document, number: int, primitives: list[dict[str, Any]]) -> Document:
    """A copy of the document in which a mesh has only some primitives."""
    out = copy.copy(document)
    meshes = list(document.json["meshes"])
    meshes[number] = {**meshes[number], "primitives": primitives}
    out.json = {**document.json, "meshes": meshes}
    return out


def _material(document: Document, number: int, known: dict[int, Material]) -> Material | None:
    """The name, the base colour and the pictures of a material; None for a negative number."""
    if number < 0:
        return None
    if number not in known:
        row = document.item("materials", number, "primitives.material")
        out = known[number] = Material(str(row.get("name") or f"material{number}"))
        own = row.get("pbrMetallicRoughness")
        rough: Mapping[str, Any] = own if isinstance(own, dict) else {}
        factor = rough.get("baseColorFactor")
        if isinstance(factor, list) and len(factor) == 4 and _all_numbers(factor):
            out.color = as_stored(factor)
        uses = {"color": rough.get("baseColorTexture"), "normal": row.get("normalTexture"),
                "orm": rough.get("metallicRoughnessTexture")}  # fmt: skip
        for role, use in uses.items():
            if isinstance(use, dict):
                _add_picture(document, use, role, out)
    return known[number]


def _all_numbers(values: list[Any]) -> bool:
    return all(isinstance(v, int | float) and -1e9 < v < 1e9 for v in values)


def _add_picture(document: Document, use: Mapping[str, Any], role: str, out: Material) -> None:
    """Add the picture of a role to a material, or a note if the picture cannot be read."""
    texture = document.item("textures", use.get("index"), f"{out.name}.{role}")
    extra = texture.get("extensions")
    extensions = extra if isinstance(extra, dict) else {}
    webp = extensions.get("EXT_texture_webp")
    index = webp.get("source") if isinstance(webp, dict) else texture.get("source")
    if index is None:
        names = ", ".join(extensions) or "no source"
        out.notes.append(f"{out.name}: its {role} texture is left out: {names} is not supported")
        return
    image = document.item("images", index, f"{out.name}.{role}")
    try:
        data = _image_bytes(document, image, f"images[{index}]")
    except _PictureError as error:
        out.notes.append(f"{out.name}: its {role} texture is left out: {error}")
        return
    out.pictures[role] = data


def _image_bytes(document: Document, image: Mapping[str, Any], place: str) -> bytes:
    uri = image.get("uri")
    if uri is None:
        return document.view_bytes(image.get("bufferView"), place)
    if not isinstance(uri, str):
        raise document.fail(place, f"a uri was expected, found {shown(uri)}")
    if uri.startswith("data:"):
        try:
            return base64.b64decode(uri.partition(",")[2], validate=True)
        except (binascii.Error, ValueError) as error:
            raise document.fail(place, f"base64 was expected: {error}") from error
    file = unquote(uri)
    # Only files in the glTF's folder or below are read, because a URI could name any file.
    if re.match(r"[a-zA-Z]+:|[/\\]", file) or ".." in re.split(r"[/\\]", file):
        raise document.fail(
            place,
            f"a file beside this one was expected, in the folder of the glTF, found {uri[:80]!r}",
        )
    try:
        return read_bytes(document.path.parent / file, found=True)
    except AnimationFileError as error:
        raise _PictureError(str(error)) from error


class _PictureError(RisoriusError):
    """A separate picture file cannot be read. The face is made without the picture."""
