# SPDX-License-Identifier: MIT
"""Rotates and scales a head of any unit and direction: cm, y up, face towards +z, left at +x."""

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
from .balls import paired_balls
from .errors import AnyHeadError
from .form.standing import CHIN, TOP
from .landmarks.find import Found, Hints, find_form
from .landmarks.groups import Box, head_box
from .landmarks.marks import LandmarkError, Landmarks
from .surface import Surface
from .telling import Progress

_FLAT = 1e-3  # smallest side of a head's bounding box, as a fraction of its longest side
_SNAP = 20.0  # degrees: a head that leans less is turned by right angles only
# Kinds of meshes, as the module web.kinds names them, in which no face is searched for.
_ASIDE = ("hair", "cloth", "lashes", "teeth", "tongue", "gum", "eyes", "wet")


@dataclass(frozen=True)
class Standing:
    """A head in the standing space: cm, y up, the face towards +z, left at +x.

    Attributes:
        parts: its meshes, without shapes.
        found: the fitted head model and the landmarks in the standing space.
        own: the landmarks in the space of the input meshes.
        notes: sentences about guesses.
    """

    parts: list[HeadPart]
    found: Found
    own: Landmarks
    notes: list[str]


def stand(
    where: str,
    parts: Sequence[HeadPart],
    unit: str,
    wishes: Wishes,
    marks: Landmarks | None,
    progress: Progress | None = None,
) -> Standing:
    """Find the face of a head, and rotate and scale all meshes to the standing space.

    Args:
        where: name of the head in error messages.
        parts: the meshes of the head in one space; they are not changed.
        unit: the unit of the head's file format, "cm" or "m".
        wishes: values that the user gave and that are not guessed.
        marks: landmarks that the user placed, in the space of the parts.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        AnyHeadError: there are no polygons, a coordinate is not finite or too large, all vertices
            are in one plane, or a value of `wishes` is invalid.
        LandmarkError: no face was found, landmarks are missing, or the lips are joined.
        Stopped: `progress` returned False.
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
    hints = Hints(where, given, up, front, paired_balls(able), box=named_box(parts))
    found, backwards = _found(skin, hints, progress)
    if backwards:
        notes.append("the polygons faced inwards and were flipped")
    found.landmarks.require(where)
    found.require_lips(where)
    turn = _upright(found.pose.rotation)
    factor, odd = _factor((TOP - CHIN) * found.pose.scale, unit, wishes)
    if not np.array_equal(turn, np.eye(3)):
        looks, top = word_of(turn[2]), word_of(turn[1])
        notes.append(
            f"by its form, the face looks roughly along {looks}, its top is {top}: it was turned "
            "upright"
        )
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


def named_box(parts: Sequence[HeadPart]) -> Box | None:
    """A box around the head by the names of meshes and groups; None if no name tells.

    Args:
        parts: the meshes of the head or body in one space.
    """
    rows = [(part.name, part.mesh.positions) for part in parts]
    return head_box([*rows, *(row for part in parts for row in part.groups.items())])


def _found(skin: Surface, hints: Hints, progress: Progress | None) -> tuple[Found, bool]:
    """The fitted head model, and whether all polygons must be reversed.

    Reversed polygons are tried first if most polygons face inward. If no face is found in them, the
    original ones are used, because perhaps only attached meshes are inside out.
    """
    if _inside_out(skin):
        try:
            return find_form(Surface(skin.points, skin.triangles[:, ::-1]), hints, progress), True
        except LandmarkError:
            pass
    return find_form(skin, hints, progress), False


def _skin_of(where: str, parts: Sequence[HeadPart], named: str) -> Surface:
    """All meshes that may be skin, as one surface; only the named mesh if `named` is not ""."""
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
    """The factor from the head's unit to cm, and notes on an unusual height.

    Args:
        height: height from the chin to the top of the head, in the head's unit.
        unit: the unit of the file format.
        wishes: the user's unit, scale or height, which have precedence.
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
    """Whether triangles face inward, as in a mirrored file, so that the volume is negative.

    Args:
        surface: a closed surface, or one with small openings.
    """
    middle = surface.points[np.unique(surface.triangles)].mean(axis=0)
    a, b, c = (surface.points[surface.triangles[:, k]] - middle for k in range(3))
    return float(np.einsum("ti,ti->t", a, np.cross(b, c)).sum()) < 0


def _upright(rotation: Doubles) -> Doubles:
    """float64[3, 3]: the rotation of a head to the standing space.

    If the head is within 20 degrees of the axes of its file, the rotation maps axes to axes.

    Args:
        rotation: float64[3, 3], the rotation from the standing space to the head.
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
