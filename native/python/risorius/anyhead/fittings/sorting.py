# SPDX-License-Identifier: MIT
"""Finds the kind of each mesh of a head (teeth, lashes, hair ...) by its name, form and place."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ...author.heads.islands import islands_of
from ...author.heads.parts import HeadPart, first_vertices, taken_apart
from ...author.heads.turning import Eye, take_eyes
from ...author.input.obj import ObjMesh
from ...base.errors import ArgumentError
from ..eyes.eyeballs import Eyeball
from ..surface import Surface
from .fitted import (
    BROWS,
    EYE,
    GUMS,
    HAIR,
    HEAD,
    JAW,
    LASHES,
    OTHER,
    SKIN,
    TEETH,
    TONGUE,
    Fitted,
    Fittings,
)

_NAMES = (
    (LASHES, r"lash"),
    (BROWS, r"brow"),
    (SKIN, r"cornea|tear|wet|eye_?(edge|shell|line)|occlu|caruncle|cartilage|beard|mous?tache"),
    (TONGUE, r"tongue"),
    (GUMS, r"gum"),
    (TEETH, r"teeth|tooth|dent"),
    (HAIR, r"hair|scalp|fringe|pony|bang"),
    (OTHER, r"shirt|cloth|collar|body|glass|hat|helmet|earring"),
)  # fmt: skip
_LOWER = re.compile(r"low|bottom|down|mandib|(?:^|[_\W])[dl](?:[_\W]|$)", re.IGNORECASE)
_UPPER = re.compile(r"upp?|top|maxill|(?:^|[_\W])u(?:[_\W]|$)", re.IGNORECASE)
_HEIGHT = 23.0  # cm: height of a face
_NEAR = 2.6  # radii of an eye: largest distance of lids from its centre
_AT_EYE = 2.4  # radii of an eye: largest distance of lashes from its centre
_LASH = 0.25  # largest extent of a mesh at an eye / height of the face
_MOUTH_HALF, _MOUTH_HIGH = 3.6, 4.0  # cm: largest half width and height of teeth or a tongue
_APART = 0.3  # cm: least distance between the middles of both rows of teeth
_LARGE = 9.0  # cm: least extent of hair


def sort_parts(parts: Sequence[HeadPart]) -> Fittings:
    """Sort the meshes of a head into the skin, the eyes and other kinds.

    Args:
        parts: all meshes, in cm, y up, the face towards +z, left at +x.

    Raises:
        ArgumentError: no mesh has polygons.
    """
    able = [part for part in parts if part.mesh.faces]
    if not able:
        raise ArgumentError("a mesh with polygons was expected, found none")
    rest, eyes = take_eyes(able, _HEIGHT, {})
    islands = [piece for part in rest for piece in _pieces(part, eyes)]
    face = _face(islands, eyes)
    out = Fittings(face)
    for eye in eyes:
        out.eyes[eye.side] = eyeball_of(eye)
        out.rows.extend(Fitted(EYE, part, eye.side) for part in eye.parts)
    place = _Place(face, eyes)
    others = [piece for piece in islands if piece is not face]
    own = [piece for piece in others if piece.source == face.source and _is_skin(piece, place)]
    if own:  # fragments of a scan or ears: they stay in the mesh of the face
        others = [piece for piece in others if all(piece is not crumb for crumb in own)]
        face = out.face = _in_one([face, *own], face.name)
    whole = [part for part in rest if part.source == face.source]
    if len(whole) == 1 and len(whole[0].mesh.faces) == len(face.mesh.faces):
        out.face = whole[0]  # no island was separated: the vertices keep their indices
    for piece in _gathered(others, place):
        out.rows.append(piece)
    _divide_mouth(out, place)
    out.notes.extend(_said(out))
    return out


def eyeball_of(eye: Eye) -> Eyeball:
    """The eyeball with its cornea as one surface.

    Args:
        eye: an eye that take_eyes found.
    """
    points, triangles, first = [], [], 0
    for part in eye.parts:
        surface = Surface.of_polygons(part.mesh.positions, part.mesh.faces)
        points.append(surface.points)
        triangles.append(surface.triangles + first)
        first += len(surface.points)
    ball = eye.ball
    return Eyeball(eye.side, ball.middle, ball.radius, np.concatenate(points),
                   np.concatenate(triangles))  # fmt: skip


def _pieces(part: HeadPart, eyes: Sequence[Eye]) -> list[HeadPart]:
    """The islands of a mesh as meshes; the island that is most likely the face is the first. A mesh
    whose name shows its kind, such as "teeth", stays whole."""
    if _named(part.name) is not None:
        return [part]
    labels = islands_of(part.mesh)
    count = int(labels.max()) + 1
    if count == 1:
        return [part]
    sizes = np.bincount(labels, minlength=count)
    main = int(sizes.argmax())
    if eyes:
        near = np.zeros(count)
        for eye in eyes:
            away = np.linalg.norm(part.mesh.positions - eye.ball.middle, axis=1)
            close = labels[away < _NEAR * eye.ball.radius]
            near += np.minimum(np.bincount(close, minlength=count), 1) * count
        main = int((near * sizes).argmax()) if near.any() else main
    order = np.argsort(np.argsort(-sizes, kind="stable"), kind="stable")
    name = [part.name, *(f"{part.name}_{k}" for k in range(1, count))]
    of_island = np.where(np.arange(count) == main, 0, 1 + order)
    of_island = np.unique(of_island, return_inverse=True)[1]
    return taken_apart(part, name, of_island[labels[first_vertices(part)]])


def _named(name: str) -> str | None:
    for kind, words in _NAMES:
        if re.search(words, name, re.IGNORECASE):
            return kind
    return None


def _face(islands: Sequence[HeadPart], eyes: Sequence[Eye]) -> HeadPart:
    """The island with the most vertices around both eyes; without eyes the largest island."""
    able = [piece for piece in islands if _named(piece.name) is None] or list(islands)

    def around(piece: HeadPart) -> tuple[int, int]:
        counts = [
            int((np.linalg.norm(piece.mesh.positions - eye.ball.middle, axis=1)
                 < _NEAR * eye.ball.radius).sum())
            for eye in eyes
        ]  # fmt: skip
        return (min(counts) if counts else 0, len(piece.mesh.positions))

    return max(able, key=around)


class _Place:
    """The approximate places of the eyes and the mouth of a face."""

    def __init__(self, face: HeadPart, eyes: Sequence[Eye]) -> None:
        self.eyes = eyes
        points = face.mesh.positions
        self.middle = float((points[:, 0].min() + points[:, 0].max()) / 2)
        if eyes:
            self.middle = float(np.mean([eye.ball.middle[0] for eye in eyes]))
            self.eye_height = float(np.mean([eye.ball.middle[1] for eye in eyes]))
            apart = float(np.ptp([eye.ball.middle[0] for eye in eyes]))
        else:
            self.eye_height = float(points[:, 1].max()) - 0.45 * _HEIGHT
            apart = 6.3
        self.unit = max(apart / 6.3, 0.5)  # length of 1 cm of a human face
        near = np.abs(points[:, 0] - self.middle) < 2.5 * self.unit
        near &= np.abs(points[:, 1] - self.mouth_height) < 2.0 * self.unit
        self.front = float(points[near, 2].max()) if near.any() else float(points[:, 2].max())

    @property
    def mouth_height(self) -> float:
        return self.eye_height - 7.0 * self.unit

    def in_mouth(self, points: Doubles) -> bool:
        """Whether points have the size and the place of a mesh behind the lips."""
        low, high = points.min(axis=0), points.max(axis=0)
        middle = (low + high) / 2
        return bool(
            abs(middle[0] - self.middle) < 1.0 * self.unit
            and high[0] - low[0] < 2 * _MOUTH_HALF * self.unit
            and abs(middle[1] - self.mouth_height) < _MOUTH_HIGH * self.unit
            and high[1] - low[1] < _MOUTH_HIGH * self.unit
            and high[2] < self.front + 0.3 * self.unit
            and high[2] > self.front - 8.0 * self.unit
        )

    def at_eye(self, points: Doubles) -> bool:
        """Whether points belong to a small mesh around an eye."""
        if np.ptp(points, axis=0).max() > _LASH * _HEIGHT * self.unit:
            return False
        return any(
            bool((np.linalg.norm(points - eye.ball.middle, axis=1)
                  < _AT_EYE * eye.ball.radius).all())
            for eye in self.eyes
        )  # fmt: skip


def _gathered(pieces: Sequence[HeadPart], place: _Place) -> list[Fitted]:
    """The meshes with their kinds; islands of the same mesh and kind are joined again."""
    groups: dict[tuple[str, str], list[HeadPart]] = {}
    for piece in pieces:
        kind = _named(piece.name) or _by_place(piece, place)
        groups.setdefault((kind, piece.source), []).append(piece)
    return [Fitted(kind, _joined(own, kind)) for (kind, _), own in groups.items()]


def _is_skin(piece: HeadPart, place: _Place) -> bool:
    return _named(piece.name) is None and _by_place(piece, place) in (SKIN, OTHER)


def _by_place(piece: HeadPart, place: _Place) -> str:
    points = piece.mesh.positions
    if place.at_eye(points):
        return LASHES if _is_flat(points) else SKIN
    if place.in_mouth(points):
        deep, wide = float(np.ptp(points[:, 2])), float(np.ptp(points[:, 0]))
        low = (points[:, 1].min() + points[:, 1].max()) / 2 < place.mouth_height
        full = len(points) > 30 and deep > 0.9 * wide and deep > 2.5 * place.unit
        # A row of teeth is an arch with an empty middle; a tongue fills its middle.
        middle = np.abs(points[:, 0] - place.middle) < 0.15 * wide
        filled = np.ptp(points[middle, 2]) > 0.7 * deep if middle.any() else False
        return TONGUE if full and filled and low else TEETH
    if np.ptp(points, axis=0).max() > _LARGE * place.unit:
        return HAIR if points[:, 1].max() > place.eye_height else OTHER
    return SKIN if piece.mesh.positions[:, 1].min() > place.mouth_height - 8 else OTHER


def _is_flat(points: Doubles) -> bool:
    """Whether the smallest side of the bounding box is below 0.6 of its largest side. Lashes are
    flat in this sense; a shell around an eyeball is not."""
    extent = np.sort(np.ptp(points, axis=0))
    return bool(extent[0] < 0.6 * extent[2])


def _joined(pieces: Sequence[HeadPart], kind: str) -> HeadPart:
    """Islands of a mesh that have the same kind, joined into one mesh. The result keeps the name of
    the mesh if there is a single island and the name shows the kind. Otherwise lashes, brows,
    teeth, tongue and gums are named after their kind."""
    first = pieces[0]
    name = first.name if len(pieces) == 1 and _named(first.name) else _called(first, kind)
    if len(pieces) == 1:
        first.name = name
        return first
    return _in_one(pieces, name)


def _in_one(pieces: Sequence[HeadPart], name: str) -> HeadPart:
    """Parts of one object, joined into one mesh with the polygons in the order of the object."""
    first = pieces[0]
    numbers = np.concatenate(
        [
            piece.polygons if piece.polygons is not None else np.arange(len(piece.mesh.faces))
            for piece in pieces
        ]
    )
    faces: list[list[int]] = []
    uv_faces: list[list[int]] = []
    start = 0
    for piece in pieces:
        faces.extend([v + start for v in face] for face in piece.mesh.faces)
        uv_faces.extend(piece.mesh.uv_faces)
        start += len(piece.mesh.positions)
    order = np.argsort(numbers, kind="stable")
    mesh = ObjMesh(
        np.concatenate([piece.mesh.positions for piece in pieces]),
        first.mesh.uvs,
        [faces[k] for k in order],
        [uv_faces[k] for k in order],
    )
    return HeadPart(name, mesh, {}, first.material, first.source, numbers[order])


def _called(piece: HeadPart, kind: str) -> str:
    words = {LASHES: "eyelashes", BROWS: "eyebrows", TEETH: "teeth", TONGUE: "tongue", GUMS: "gums"}
    return words.get(kind, piece.name)


def _divide_mouth(out: Fittings, place: _Place) -> None:
    """Attach upper teeth and gums to the head, and lower teeth and gums and the tongue to the
    jaw."""
    rows: list[Fitted] = []
    middle = _between_rows(out, place)
    for row in out.rows:
        if row.kind == TONGUE:
            row.hangs = JAW
            row.part.name = _with(row.part.name, "tongue")
        if row.kind in (TEETH, GUMS):
            rows.extend(_rows_of_teeth(row, middle, out.notes))
        else:
            rows.append(row)
    out.rows = rows


def _heights(part: HeadPart) -> tuple[Ints, Doubles]:
    """int64[V]: the island of each vertex; float64[islands]: the y of the middle of each island."""
    labels: Ints = islands_of(part.mesh)
    heights, count = part.mesh.positions[:, 1], int(labels.max()) + 1
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, labels, heights)
    np.maximum.at(high, labels, heights)
    return labels, (low + high) / 2


def _between_rows(out: Fittings, place: _Place) -> float:
    """The y of the line between upper and lower teeth; without two rows of teeth, the y of the
    mouth."""
    middles = [_heights(row.part)[1] for row in out.of(TEETH)]
    every = np.concatenate(middles) if middles else np.zeros(0)
    apart = float(np.ptp(every)) if len(every) > 1 else 0.0
    return (
        float(every.min() + every.max()) / 2
        if apart > _APART * place.unit
        else (place.mouth_height)
    )


def _rows_of_teeth(row: Fitted, middle: float, notes: list[str]) -> list[Fitted]:
    name = row.part.name
    word = "gums" if row.kind == GUMS else "teeth"
    if _LOWER.search(name) and not _UPPER.search(name):
        return [Fitted(row.kind, row.part, "", JAW)]
    if _UPPER.search(name):
        return [Fitted(row.kind, row.part, "", HEAD)]
    labels, middles = _heights(row.part)
    low = middles < middle
    if low.all() or not low.any():
        hangs = JAW if low.all() else HEAD
        if len(low) == 1:
            notes.append(
                f"{name} is one piece: it follows the jaw"
                if hangs == JAW
                else f"{name} is one piece: it follows the head"
            )
        row.part.name = f"{word}{'Lower' if hangs == JAW else 'Upper'}"
        return [Fitted(row.kind, row.part, "", hangs)]
    names = [f"{word}Upper", f"{word}Lower"]
    pieces = taken_apart(row.part, names, low[labels[first_vertices(row.part)]].astype(np.int64))
    return [
        Fitted(row.kind, piece, "", JAW if piece.name == names[1] else HEAD) for piece in pieces
    ]


def _with(name: str, word: str) -> str:
    return name if word in name.lower() else f"{word}_{name}"


def _said(out: Fittings) -> list[str]:
    notes = []
    if out.eyes:
        names = dict.fromkeys(row.part.source or row.part.name for row in out.of(EYE))
        notes.append(f"{', '.join(names)}: the eyes are the head's own")
    for kind, words in (
        (TEETH, "the teeth"), (GUMS, "the gums"), (TONGUE, "the tongue"), (LASHES, "the lashes"),
        (BROWS, "the brows"), (HAIR, "the hair"),
    ):  # fmt: skip
        rows = out.of(kind)
        if rows:
            names = dict.fromkeys(row.part.source or row.part.name for row in rows)
            notes.append(f"{', '.join(names)}: {words}")
    left = out.of(OTHER, SKIN)
    if left:
        notes.append(f"other meshes that follow the head or its skin: {len(left):,}")
    return notes
