# SPDX-License-Identifier: MIT
"""A head of any unit and direction made to stand: cm, y up, the face towards z, its left at x."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..author.geometry.skeleton import FARTHEST, Doubles
from ..author.heads.directions import axis_of, check_axes, word_of
from ..author.heads.parts import HeadPart, Wishes
from ..author.heads.sizes import UNITS, check_unit, find_unit
from ..author.input.obj import ObjMesh
from ..web.kinds import kind_of
from .errors import AnyHeadError
from .form.standing import CHIN, TOP
from .landmarks.find import Found, Hints, find_form
from .landmarks.marks import LandmarkError, Landmarks
from .surface import Surface

_FLAT = 1e-3  # of the longest side
_SNAP = 20.0  # degrees
_ASIDE = ("hair", "cloth", "lashes", "teeth", "tongue", "gum", "eyes", "wet")


@dataclass(frozen=True)
class Standing:
    """A head that stands.

    Attributes:
        parts: its meshes, without shapes.
        found: the form and the landmarks, of the standing head.
        own: the landmarks where the head was before.
        notes: what was guessed, a sentence each.
    """

    parts: list[HeadPart]
    found: Found
    own: Landmarks
    notes: list[str]


def stand(
    where: str, parts: Sequence[HeadPart], unit: str, wishes: Wishes, marks: Landmarks | None
) -> Standing:
    """Find the face and turn and scale all meshes.

    Args:
        where: what errors call the head.
        parts: in one space; they stay as they are.
        unit: of their numbers as the format has it, "cm" or "m".
        wishes: what is said and not guessed.
        marks: landmarks that a person gave, in the space of the parts.

    Raises:
        AnyHeadError: no polygons, or wishes that cannot be.
        LandmarkError: no face, or landmarks that are missing.
    """
    wrong = check_axes(wishes) or (check_unit(wishes.unit) if wishes.unit else "")
    if wrong:
        raise AnyHeadError(f"{where}: {wrong}")
    able = [part for part in parts if part.mesh.faces]
    if not able:
        raise AnyHeadError(f"{where}: a mesh with polygons was expected, found none")
    _check_size(where, able)
    up, front = (axis_of(word) if word else None for word in (wishes.up, wishes.front))
    given = marks.points if marks is not None else {}
    skin, notes = _skin_of(where, able, wishes.mesh), []
    found, backwards = _found(skin, Hints(where, given, up=up, front=front))
    if backwards:
        notes.append("the polygons show their backs: they are turned")
    found.landmarks.require(where)
    found.require_lips(where)
    turn = _upright(found.pose.rotation)
    factor, odd = _factor((TOP - CHIN) * found.pose.scale, unit, wishes)
    if not np.array_equal(turn, np.eye(3)):
        looks, top = word_of(turn[2]), word_of(turn[1])
        notes.append(f"the face looks about along {looks}, its top is {top} (by its form): it is "
                     "turned until it stands")  # fmt: skip
    pose = replace(
        found.pose,
        rotation=turn @ found.pose.rotation,
        scale=factor * found.pose.scale,
        shift=factor * turn @ found.pose.shift,
    )
    points = {name: factor * turn @ p for name, p in found.landmarks.points.items()}
    landmarks = replace(found.landmarks, points=points)
    return Standing(
        [_stood(part, factor * turn, backwards=backwards) for part in able],
        replace(found, landmarks=landmarks, pose=pose),
        found.landmarks,
        [*notes, *odd, *found.landmarks.notes],
    )


def _found(skin: Surface, hints: Hints) -> tuple[Found, bool]:
    """The form of a head, and whether its polygons are to be turned. What hangs on it may be
    turned where the head is not."""
    if _inside_out(skin):
        try:
            return find_form(Surface(skin.points, skin.triangles[:, ::-1]), hints), True
        except LandmarkError:
            pass
    return find_form(skin, hints), False


def _skin_of(where: str, parts: Sequence[HeadPart], named: str) -> Surface:
    """All that may be skin, as one surface; the mesh that a person named alone."""
    chosen = [part for part in parts if part.source == named] if named else list(parts)
    if not chosen:
        names = ", ".join(dict.fromkeys(part.source for part in parts))
        raise AnyHeadError(f"{where}: mesh: one of {names} was expected, found {named}")
    skin = [part for part in chosen if kind_of(part.name) not in _ASIDE] or chosen
    starts = np.cumsum([0, *(len(part.mesh.positions) for part in skin)])
    surfaces = [Surface.of_polygons(part.mesh.positions, part.mesh.faces) for part in skin]
    return Surface(
        np.concatenate([s.points for s in surfaces]),
        np.concatenate([s.triangles + n for s, n in zip(surfaces, starts[:-1], strict=True)]),
    )


def _check_size(where: str, parts: Sequence[HeadPart]) -> None:
    points = np.concatenate([part.mesh.positions for part in parts])
    largest = float(np.abs(points).max(initial=0.0))
    if not largest <= FARTHEST:
        raise AnyHeadError(
            f"{where}: coordinates up to {FARTHEST:g} were expected, found {largest:g}"
        )
    extent = np.ptp(points, axis=0)
    if not extent.min() > _FLAT * extent.max():
        raise AnyHeadError(f"{where}: a head was expected, found vertices in one plane")


def _factor(height: float, unit: str, wishes: Wishes) -> tuple[float, list[str]]:
    """What makes the head's numbers cm, and what is odd about them.

    Args:
        height: of the face in them, from the chin to the top.
        unit: as the format says.
        wishes: as a person says.
    """
    if wishes.height_mm:
        return wishes.height_mm / (UNITS["cm"] * height), []
    scale = wishes.scale or 1.0
    sure = bool(wishes.unit or wishes.scale)
    found, odd = find_unit(height * scale, wishes.unit or unit, sure=sure)
    return scale * UNITS[found] / UNITS["cm"], [odd] if odd else []


def _stood(part: HeadPart, turn: Doubles, *, backwards: bool) -> HeadPart:
    mesh, order = part.mesh, -1 if backwards else 1
    placed = ObjMesh(
        mesh.positions @ turn.T,
        mesh.uvs,
        [face[::order] for face in mesh.faces],
        [face[::order] for face in mesh.uv_faces],
    )
    return HeadPart(part.name, placed, {}, part.material, part.source, part.polygons)


def _inside_out(surface: Surface) -> bool:
    """Whether most triangles show their backs, as in a mirrored file.

    Args:
        surface: closed, or with openings that are small against the whole.
    """
    middle = surface.points[np.unique(surface.triangles)].mean(axis=0)
    a, b, c = (surface.points[surface.triangles[:, k]] - middle for k in range(3))
    return float(np.einsum("ti,ti->t", a, np.cross(b, c)).sum()) < 0


def _upright(rotation: Doubles) -> Doubles:
    """The rotation that makes a head stand, float64[3, 3].

    A head within 20 degrees of the axes of its file keeps to these axes.

    Args:
        rotation: float64[3, 3], from the standing form to the head.
    """
    axes = np.zeros((3, 3))
    for row, column in ((1, 1), (2, 2)):  # up, then front
        way = rotation[:, column] * (1 - np.abs(axes).sum(axis=0))
        at = int(np.abs(way).argmax())
        axes[row, at] = np.sign(way[at])
    axes[0] = np.cross(axes[1], axes[2])
    cosine = (np.trace(axes @ rotation) - 1) / 2
    if np.degrees(np.arccos(np.clip(cosine, -1, 1))) < _SNAP:
        return axes
    return np.asarray(rotation.T.copy())
