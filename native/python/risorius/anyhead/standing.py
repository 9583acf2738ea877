# SPDX-License-Identifier: MIT
"""A head of any unit and direction made to stand: cm, y up, the face towards z, its left at x."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..author.geometry.skeleton import Doubles
from ..author.heads.directions import axis_of, check_axes, word_of
from ..author.heads.parts import HeadPart, Wishes
from ..author.heads.sizes import UNITS, check_unit, find_unit
from ..author.input.obj import ObjMesh
from ..web.kinds import kind_of
from .errors import AnyHeadError
from .form.standing import CHIN, TOP
from .landmarks.find import Found, Hints, find_form
from .landmarks.marks import Landmarks
from .surface import Surface

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
    up, front = (axis_of(word) if word else None for word in (wishes.up, wishes.front))
    given = marks.points if marks is not None else {}
    found = find_form(_skin_of(where, able, wishes.mesh), Hints(where, given, up, front))
    found.landmarks.require(where)
    turn = _turn(found.pose.rotation)
    factor, notes = _factor((TOP - CHIN) * found.pose.scale, unit, wishes)
    if not np.array_equal(turn, np.eye(3)):
        looks, top = word_of(turn[2]), word_of(turn[1])
        notes.insert(0, f"the face looks along {looks}, its top is {top} (by its form)")
    pose = replace(
        found.pose,
        rotation=turn @ found.pose.rotation,
        scale=factor * found.pose.scale,
        shift=factor * turn @ found.pose.shift,
    )
    points = {name: factor * turn @ p for name, p in found.landmarks.points.items()}
    landmarks = replace(found.landmarks, points=points)
    return Standing(
        [_stood(part, factor * turn) for part in able],
        replace(found, landmarks=landmarks, pose=pose),
        found.landmarks,
        [*notes, *found.landmarks.notes],
    )


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


def _turn(rotation: Doubles) -> Doubles:
    """float64[3, 3], along the axes, from where a head is to standing: a head that leans a little
    keeps its lean, as in authoring.

    Args:
        rotation: float64[3, 3], from the form to the head.
    """
    best = np.eye(3)
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.array(signs)[:, None] * np.eye(3)[list(order)]
            if np.linalg.det(turn) > 0 and np.trace(turn @ rotation) > np.trace(best @ rotation):
                best = turn
    return best


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


def _stood(part: HeadPart, turn: Doubles) -> HeadPart:
    mesh = part.mesh
    placed = ObjMesh(mesh.positions @ turn.T, mesh.uvs, mesh.faces, mesh.uv_faces)
    return HeadPart(part.name, placed, {}, part.material, part.source, part.polygons)
