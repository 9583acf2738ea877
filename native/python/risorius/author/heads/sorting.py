# SPDX-License-Identifier: MIT
"""Sorts the meshes of a head: the face, meshes that follow the head or the jaw, other heads."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from ...base.words import counted, joined
from ..geometry.skeleton import Doubles
from ..input.obj import ShapeFileError
from .islands import islands_of
from .parts import HeadPart, first_vertices, in_face_names, taken_apart
from .sizes import in_words

HEAD, JAW, FACE = "head", "FACIAL_C_Jaw", ""
_MOUTH = re.compile(r"te[e]th|tooth|gum|tongue|mouth|jaw|dent", re.IGNORECASE)
_TONGUE = re.compile(r"tongue", re.IGNORECASE)
_LOWER = re.compile(r"low|bottom|down|mandib|(?:^|[_\W])[dl](?:[_\W]|$)", re.IGNORECASE)
_UPPER = re.compile(r"upp?|top|maxill|(?:^|[_\W])u(?:[_\W]|$)", re.IGNORECASE)
_COARSE = re.compile(r"lod_?[1-9]", re.IGNORECASE)
_AROUND, _LARGEST = 0.75, 3.0  # largest distance and size of a mesh of the head, in face heights
_ALIKE = 3  # smallest number of common expressions of another head


def moves(part: HeadPart) -> bool:
    """Whether at least one shape of the mesh moves a vertex."""
    size = float(np.ptp(part.mesh.positions, axis=0).max()) or 1.0
    return any(np.abs(d).max(initial=0.0) > 1e-6 * size for d in part.shapes.values())


def choose_face(where: str, parts: Sequence[HeadPart], wanted: str, rather: str = "") -> HeadPart:
    """Choose the mesh of the face: the named mesh, or the mesh with most shapes times vertices.

    Args:
        where: name of the file in error messages.
        parts: all meshes.
        wanted: name of the face's mesh, which must exist, or "".
        rather: name of the mesh that is preferred if the file has several heads, or "".

    Raises:
        ShapeFileError: no mesh has shapes that move it, no such mesh has the wanted name, or the
            file has several heads and neither `wanted` nor `rather` chooses one.
    """
    able = [part for part in parts if moves(part)]
    named = [part for part in able if part.source == wanted] if wanted else able
    if not named:
        if able:
            names = joined(dict.fromkeys(part.source for part in able))
            raise ShapeFileError(
                f"{where}: source.mesh: one of {names} was expected, found {wanted}"
            )
        if any(part.shapes for part in parts):
            raise ShapeFileError(f"{where}: no expression moves a vertex of a mesh")
        raise ShapeFileError(f"{where}: a mesh with shapes was expected, found none")
    face = max(named, key=lambda p: (len(p.shapes) * len(p.mesh.positions), -parts.index(p)))
    others = [part for part in able if part is not face and is_other_head(face, part)]
    chosen = [part for part in (face, *others) if part.source == rather]
    if others and chosen:
        return chosen[0]
    if others and not wanted:
        names = joined([face.name, *(part.name for part in others)])
        raise ShapeFileError(
            f"{where}: one head was expected, {names} have the same shapes at different places: "
            "name one of them in source.mesh"
        )
    return face


def is_other_head(face: HeadPart, part: HeadPart) -> bool:
    """Whether a mesh with shapes belongs to another head than the face.

    Args:
        face: the mesh of the face.
        part: the other mesh.
    """
    alike = len(set(in_face_names(face, part)) & set(face.shapes))
    own, other = (np.ptp(p.mesh.positions, axis=0) for p in (face, part))
    apart = np.abs(face.center - part.center) > 0.4 * (own + other)
    return alike >= _ALIKE and bool(apart.any()) and bool(other.max() > 0.5 * own.max())


def is_coarse(part: HeadPart) -> bool:
    """Whether the mesh's name denotes a coarser level of detail, such as LOD1."""
    return _COARSE.search(part.name) is not None


class Places:
    """Finds out whether meshes are near a face's head or in its mouth; x is left, y up, z front."""

    def __init__(self, face: HeadPart, height: float, mm: float, jaw_open: Doubles | None) -> None:
        """Measure a face.

        Args:
            face: the face's mesh, upright and with x to the left, in any unit.
            height: height of the face in that unit.
            mm: length of the unit in mm.
            jaw_open: float64[V, 3], displacements of the shape that opens the mouth, or None.
        """
        self.height, self.mm, self.jaw_open = height, mm, jaw_open
        points = face.mesh.positions
        self.low, self.high = points.min(axis=0), points.max(axis=0)
        self.low[1] = self.high[1] - height
        self.mouth = -np.inf
        if jaw_open is not None:
            length = np.linalg.norm(jaw_open, axis=1)
            far = points[length > 0.6 * length.max()]
            self.mouth = float(np.quantile(far[:, 1], 0.95))

    def away(self, part: HeadPart) -> str:
        """The reason why a mesh does not belong to the head, or ""."""
        extent = np.ptp(part.mesh.positions, axis=0)
        if extent.max() > _LARGEST * self.height:
            return f"it is {in_words(extent.max() * self.mm)} large"
        low, high = self.low - part.center, part.center - self.high
        off = np.maximum(np.maximum(low, high), 0.0)
        if off.max() <= _AROUND * self.height and off[1] <= 0.5 * self.height:
            return ""
        return f"it lies {in_words(off.max() * self.mm)} from the face"

    def in_mouth(self, part: HeadPart) -> bool:
        """Whether a mesh is at the place of teeth and tongue."""
        low, high = part.mesh.positions.min(axis=0), part.mesh.positions.max(axis=0)
        width = self.high[0] - self.low[0]
        reach = 0.15 * self.height
        return bool(
            np.abs(part.center[0] - (self.low[0] + self.high[0]) / 2) < 0.15 * width
            and high[0] - low[0] < 0.6 * width
            and low[1] > self.low[1] - 0.02 * self.height
            and abs(part.center[1] - self.mouth) < reach
            and high[2] < self.high[2]
        )


def hung(part: HeadPart, places: Places) -> list[tuple[HeadPart, str]]:
    """Find the joint, head or jaw, that a mesh without shapes follows.

    A mesh with upper and lower teeth is divided into two meshes, because the upper teeth follow the
    head and the lower teeth follow the jaw.

    Args:
        part: the mesh.
        places: places of the face.

    Returns: a list of pairs: the mesh or a part of it, and the name of the joint that it follows.
    """
    if places.jaw_open is None or not (_MOUTH.search(part.name) or places.in_mouth(part)):
        return [(part, HEAD)]
    name = part.name
    if _TONGUE.search(name) or (_LOWER.search(name) and not _UPPER.search(name)):
        return [(part, JAW)]
    if _UPPER.search(name):
        return [(part, HEAD)]
    islands = islands_of(part.mesh)
    heights = part.mesh.positions[:, 1]
    low = np.array(
        [np.ptp(heights[islands == i]) / 2 + heights[islands == i].min() < places.mouth
         for i in range(int(islands.max()) + 1)]
    )  # fmt: skip
    if low.all() or not low.any():
        return [(part, JAW if low.all() else HEAD)]
    pieces = taken_apart(
        part, [f"{name}Upper", f"{name}Lower"], low[islands[first_vertices(part)]].astype(int)
    )
    return [(piece, JAW if piece.name == f"{name}Lower" else HEAD) for piece in pieces]


def said_of(part: HeadPart, joint: str, shapes: Mapping[str, Doubles]) -> str:
    """A sentence on how a mesh moves.

    Args:
        part: the mesh.
        joint: joint that the mesh follows, or FACE if it moves by shapes.
        shapes: the shapes that move it.
    """
    if joint == FACE:
        return f"{part.name} follows the face with {counted(len(shapes), 'shape')}"
    return f"{part.name} hangs on the jaw" if joint == JAW else f"{part.name} hangs on the head"
