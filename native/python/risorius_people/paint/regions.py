# SPDX-License-Identifier: MIT
"""Computes where a head has blood, pigment, hair roots, pores and oil, as values at its vertices.

Positions are in decimetres: `x` from the middle of the face, `y` up and `z` to the front from the
left eye's middle. The values are computed on the man's head, and used for all people, because they
share its topology and texture layout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from risorius.base.easing import smooth_step

from ..expressions import Expression
from ..part import Part
from ..polygons import Floats, Ints, Polygons, edges_of
from .images import smooth
from .layout import islands

FAR_RINGS = 14.0  # largest number of edge loops that are counted
# number of the base mesh's edge loops from the inside of the mouth to the outer rim of the lips
LIPS_RINGS = 8.0
DIVIDED = 2.0  # an edge of the base mesh is divided into this many edges of the head at LOD 0
# decimetres: size of the spots of the finest of the three noises; the others have spots 1.6 and 2.6
# times as large
_REACH = 0.12


@dataclass
class Face:
    """The vertices of a head: x from the middle of the face, y and z from the left eye's middle.

    Attributes:
        x: float64[V], to the side; the character's left is positive.
        y: float64[V], up.
        z: float64[V], to the front.
        lids: float64[V], mask of the lids: 0 for vertices that a blink moves by at most a tenth of
            its largest displacement, 1 from 8 tenths on, and smooth between them.
        mouth: float64[V], number of the base mesh's edge loops from the inside of the mouth, which
            is an island of the texture; negative inside; limited to 14 and -14.
        eyes: float64[V], number of edge loops from the skin behind the lids; negative there;
            limited to 14 and -14.
        uneven: float64[V, 3], three noises with mean 0 and standard deviation about 1, equal on
            both sides of texture seams.
    """

    x: Floats
    y: Floats
    z: Floats
    lids: Floats
    mouth: Floats
    eyes: Floats
    uneven: Floats

    @property
    def aside(self) -> Floats:
        """float64[V]: distance from the middle of the face, |x|."""
        return np.abs(self.x)

    def spot(self, x: float, y: float, wide: float, high: float) -> Floats:
        """float64[V]: a soft spot on the front of the face and its mirror image, 1 in each middle.

        Args:
            x, y: position of the spot's middle.
            wide, high: distances from the middle, to the side and up, at which the spot falls to a
                third of its value in the middle.
        """
        away = ((self.aside - x) / wide) ** 2 + ((self.y - y) / high) ** 2
        return np.asarray(np.exp(-away) * smooth(-0.5, -0.1, self.z))


def find_face(
    part: Part, positions: Floats, eye: Floats, units: dict[str, Expression], step: float
) -> Face:
    """Locates the parts of the face on a head.

    Args:
        part: mesh of the head.
        positions: float64[V, 3] of its vertices, in decimetres.
        eye: float64[3], middle of the left eye.
        units: raw control -> expression.
        step: number of this head's edges per edge of the base mesh.
    """
    blink = sum(
        np.linalg.norm(part.carry(units[name].displacement), axis=1)
        for name in ("eyeBlinkL", "eyeBlinkR")
    )
    x, y, z = (positions - np.array([0, eye[1], eye[2]])).T
    mouth, eyes = inner_rings(part.polygons, np.column_stack([x, y, z]))
    random = np.random.default_rng(3)
    uneven = [solid_noise(positions, _REACH * k, random) for k in (1.0, 1.6, 2.6)]
    return Face(
        x=x,
        y=y,
        z=z,
        lids=smooth(0.1, 0.8, blink / max(float(np.max(blink)), 1e-9)),
        mouth=np.clip(mouth / step, -FAR_RINGS, FAR_RINGS),
        eyes=np.clip(eyes / step, -FAR_RINGS, FAR_RINGS),
        uneven=np.column_stack(uneven),
    )


def inner_rings(polygons: Polygons, places: Floats) -> tuple[Floats, Floats]:
    """float64[V] each: number of edges from the mouth's and from the eyes' inside, negative inside.

    Args:
        polygons: polygons of the head; the insides are islands of its texture.
        places: float64[V, 3] in decimetres, from the same origin as in Face.
    """
    label = islands(polygons)
    corner = np.concatenate([np.asarray(face) for face in polygons.faces])
    owner = label[np.concatenate([np.asarray(face) for face in polygons.uv_faces])]
    edges = np.array(list(edges_of(polygons.faces)))
    inside = [np.zeros(len(places), bool), np.zeros(len(places), bool)]
    for number in range(1, int(label.max(initial=0)) + 1):
        own = np.zeros(len(places), bool)
        own[corner[owner == number]] = True
        if not own.any():
            continue
        middle = places[own].mean(axis=0)
        if abs(middle[0]) > 0.12:
            inside[1] |= own & (abs(middle[1]) < 0.3)
        elif middle[1] > -0.95:
            inside[0] |= own
    outside = np.zeros(len(places), bool)
    outside[corner[owner == 0]] = True
    mouth, eyes = (_rings(edges, one, outside) for one in inside)
    return mouth, eyes


def lips_of(rings: Floats) -> Floats:
    """float64[V]: 1 on the lips and in the mouth, where no hair grows, else 0.

    Args:
        rings: float64[V], `Face.mouth`.
    """
    return smooth(LIPS_RINGS + 1.0, LIPS_RINGS, rings)


def _rings(edges: Ints, inside: Ints, outside: Ints) -> Floats:
    far = 1e3
    out = []
    for ways in (outside, inside):
        away = np.where(inside & outside, 0.0, far)
        for _ in range(int(4 * FAR_RINGS)):
            known = away.copy()
            for a, b in (edges.T, edges.T[::-1]):
                np.minimum.at(away, a, known[b] + 1)
            away[~ways] = far
        out.append(away)
    return np.asarray(np.where(inside & ~outside, -out[1], out[0]))


def solid_noise(places: Floats, pitch: float, random: np.random.Generator) -> Floats:
    """float64[n]: smooth noise in space, with mean 0 and standard deviation about 1.

    Args:
        places: float64[n, 3], positions.
        pitch: side of a cell of the random grid, in the unit of `places`.
        random: generator of the grid.
    """
    low = places.min(axis=0) - pitch
    at = (places - low) / pitch
    cell = at.astype(int)
    part = at - cell
    part = smooth_step(part)
    grid = random.normal(size=tuple(cell.max(axis=0) + 2))
    out = np.zeros(len(places))
    for i in (0, 1):
        for j in (0, 1):
            for k in (0, 1):
                share = np.prod(np.where([i, j, k], part, 1 - part), axis=1)
                out += share * grid[cell[:, 0] + i, cell[:, 1] + j, cell[:, 2] + k]
    return np.asarray(1.7 * out)


# ---- fields of a face, float64[V] each


def ears(face: Face) -> Floats:
    """float64[V]: mask of the ears, 0 to 1."""
    near = np.hypot((face.y + 0.12) / 0.42, (face.z + 0.95) / 0.36)
    return np.asarray(smooth(0.72, 0.80, face.aside) * (1 - smooth(0.8, 1.2, near)))


def forehead(face: Face) -> Floats:
    """float64[V]: mask of the forehead from the brows to the hair, 0 to 1."""
    up = smooth(0.16, 0.34, face.y) * (1 - smooth(0.75, 0.95, face.y))
    return np.asarray(up * smooth(-0.75, -0.3, face.z))


def blood(face: Face, age: int) -> Floats:
    """float64[V]: amount of blood relative to the mean of the face; 1 is a blush.

    Args:
        face: vertices of the head.
        age: age in years; children have redder cheeks, old people redder noses.
    """
    young = np.interp(age, (8, 25), (1.2, 1.0))
    old = np.interp(age, (40, 75), (1.0, 1.5))
    u = face.uneven
    cheeks = face.spot(0.42, -0.36, 0.22, 0.19) * (0.85 + 0.2 * u[:, 0] + 0.2 * u[:, 1])
    sides = face.spot(0.52, -0.6, 0.24, 0.3) * (0.6 + 0.3 * u[:, 2])
    front = smooth(0.1, 0.25, face.z)
    tip = np.exp(-((face.aside / 0.13) ** 2) - ((face.y + 0.40) / 0.11) ** 2) * front
    wings = face.spot(0.155, -0.43, 0.055, 0.085)
    fold = face.spot(0.24, -0.58, 0.07, 0.12)
    corner = face.spot(0.175, -0.03, 0.06, 0.06)
    chin = face.spot(0.0, -1.03, 0.17, 0.10)
    out = 0.26 * young * cheeks + 0.09 * sides + old * (0.30 * tip + 0.38 * wings)
    out += 0.2 * fold + 0.2 * corner + 0.24 * chin + 0.45 * ears(face)
    out += 0.12 * face.spot(0.0, 0.12, 0.12, 0.14) - 0.10 * forehead(face)
    out -= 0.10 * face.spot(0.0, -0.6, 0.13, 0.05)
    neck = smooth(-1.1, -1.4, face.y)
    out += neck * (0.05 + 0.05 * u[:, 2])
    return np.asarray(out + 0.025 * u[:, 0] + 0.025 * u[:, 1])


def shade_of_eyes(face: Face) -> Floats:
    """float64[V]: mask of the dark skin under the eyes, where veins show, 0 to 1."""
    along = np.clip((face.aside - 0.13) / 0.30, 0, 1)
    rim = -0.15 - 0.075 * np.sin(np.pi * np.clip(along * 0.9 + 0.05, 0, 1))
    away = np.abs(face.y - rim) / 0.062
    ends = smooth(0.09, 0.17, face.aside) * (1 - smooth(0.34, 0.48, face.aside))
    return np.asarray(np.exp(-(away**2)) * ends * smooth(-0.45, -0.15, face.z))


def yellow(face: Face) -> Floats:
    """float64[V]: amount of the skin's own yellow, which shows where there is little blood."""
    temple = face.spot(0.56, 0.12, 0.16, 0.22)
    mouth = face.spot(0.0, -0.75, 0.36, 0.2) * (1 - 0.5 * face.spot(0.0, -1.03, 0.15, 0.1))
    out = 0.26 * forehead(face) + 0.2 * temple + 0.22 * mouth
    return np.asarray(out + 0.07 * face.uneven[:, 1])


def beard(face: Face) -> Floats:
    """float64[V]: density of the beard's roots, 0 to 1, with an uneven edge."""
    x, y, z = face.aside, face.y, face.z
    line = np.interp(
        x, (0.0, 0.17, 0.3, 0.45, 0.6, 0.72), (-0.53, -0.56, -0.70, -0.66, -0.45, -0.2)
    )
    under = smooth(0.05, -0.16, y - line + 0.05 * face.uneven[:, 0] + 0.04 * face.uneven[:, 1])
    neck = smooth(-1.45, -1.05, y + 0.08 * face.uneven[:, 2])
    behind = smooth(-0.95, -0.72, z)
    bare = 1 - 0.75 * face.spot(0.0, -0.89, 0.10, 0.045) - 0.55 * face.spot(0.2, -0.87, 0.08, 0.07)
    thin = 1 - 0.5 * face.spot(0.0, -0.585, 0.035, 0.05)
    jaw = 0.6 + 0.4 * np.clip(smooth(0.5, 0.25, x) + smooth(-0.75, -0.95, y), 0, 1)
    return np.asarray(np.clip(under * neck * behind * bare * thin * jaw, 0, 1))


def pores(face: Face) -> Floats:
    """float64[V]: size of the pores, 0 to 1; they are largest on and beside the nose."""
    front = smooth(0.08, 0.2, face.z)
    nose = np.exp(-((face.aside / 0.17) ** 2) - ((face.y + 0.36) / 0.2) ** 2) * front
    cheeks = face.spot(0.28, -0.36, 0.17, 0.17)
    rest = 0.5 * forehead(face) + 0.6 * face.spot(0, -1.0, 0.22, 0.16)
    return np.asarray(np.clip(0.22 + 0.8 * nose + 0.65 * cheeks + rest, 0, 1) * (1 - face.lids))


def oil(face: Face) -> Floats:
    """float64[V]: amount of gloss of the skin, 0 to 1: on forehead, nose, chin and lids."""
    front = smooth(0.08, 0.2, face.z)
    nose = np.exp(-((face.aside / 0.14) ** 2) - ((face.y + 0.3) / 0.24) ** 2) * front
    brow = forehead(face) * np.exp(-((face.aside / 0.32) ** 2))
    out = 0.7 * brow + 0.9 * nose + 0.4 * face.spot(0, -1.02, 0.16, 0.1) + 0.45 * face.lids
    return np.asarray(np.clip(out, 0, 1))


def freckled(face: Face) -> Floats:
    """float64[V]: density of freckles that the sun causes, 0 to 1: on nose and cheeks, and less on
    the forehead."""
    nose = face.spot(0, -0.24, 0.2, 0.13)
    cheeks = face.spot(0.36, -0.3, 0.2, 0.16)
    return np.asarray(
        np.clip(nose + cheeks + 0.35 * forehead(face) + 0.12, 0, 1)
        * np.clip(0.75 + 0.4 * face.uneven[:, 1], 0, 1)
    )


def weathered(face: Face) -> Floats:
    """float64[V]: density of age spots, 0 to 1: on temples, forehead, outer cheeks, scalp."""
    sides = face.spot(0.6, 0.1, 0.25, 0.35) + face.spot(0.55, -0.35, 0.2, 0.25)
    return np.asarray(np.clip(sides + 0.6 * forehead(face) + smooth(0.7, 1.0, face.y), 0, 1))
