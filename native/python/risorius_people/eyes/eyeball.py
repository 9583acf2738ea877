# SPDX-License-Identifier: MIT
"""Makes eyeballs, which the data lack: a ball with a dished iris, and a cornea.

Both are surfaces of revolution about the gaze. Their vertices are appended to those of the base
mesh, so that positions, motions and skin weights by vertex include them.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..polygons import Floats, Ints
from ..source import BaseMesh

MM = 0.01  # decimetres per millimetre
SEGMENTS = 48  # columns around the gaze
# Radius of the iris in radii of the ball. It is 5.85 mm / 12 mm in people, but the lids of the data
# fit a larger ball.
IRIS = 0.395
CORNEA = 4 / 3  # radius of the cornea divided by the radius of the iris: 7.8 mm / 5.85 mm
PUPIL = 0.33  # radius of the pupil in room light, in radii of the iris
CONVERGENCE = 1.2  # degrees by which each eye turns inwards, to look at a point 1.5 m away
# Angle in radians between the gaze and the limbus (the iris' outer edge), seen from the ball's
# middle.
_LIMBUS = float(np.arcsin(IRIS))
_EDGE = _LIMBUS + 0.22  # radians from the gaze at which the cornea's shell sinks into the ball
_SOFT = 0.012  # width of the blend between cornea and ball, in radii of the ball
_CLEAR = 0.0015  # gap between the cornea's shell and the ball, in radii of the ball
# Positions of the iris' rings, from the rim of the pupil (0) to the root of the iris (1). _ROOT,
# _MIDDLE and _RIM: depths of the iris' root, of the iris' middle and of the pupil's rim behind the
# limbus, in radii of the iris.
_IRIS_RINGS = np.array([0.0, 0.06, 0.16, 0.28, 0.42, 0.56, 0.70, 0.83, 0.93, 1.0])
_ROOT, _MIDDLE, _RIM = 0.05, 0.13, 0.09
_HOLE = 0.28  # depth of the pupil's bottom behind the pupil's rim, in radii of the iris
_BEHIND = np.array(
    [0.02, 0.06, 0.11, 0.17, 0.25, 0.35, 0.47, 0.60, 0.75, 0.92, 1.12, 1.4, 1.8, 2.25]
)
_CORNEA_RINGS = np.array(
    [0.06, 0.14, 0.24, 0.34, 0.44, 0.53, 0.61, 0.68, 0.75, 0.82, 0.89, 0.95, 1.0]
)
# Indices of the rings of the ball that the coarse LOD keeps.
_COARSE_BALL = [0, 1, 2, 4, 6, 8, 10, 11, 12, 15, 17, 19, 21, 22, 23, 24, 25, 26]
_COARSE_CORNEA = [1, 3, 5, 7, 9, 12]
# Distances of the limbus and of the angle SIDE_ANGLE (radians from the gaze) from the middle of the
# texture, in texture widths. The hidden back of the ball gets the small area beyond SIDE_AT.
IRIS_AT, SIDE_AT, SIDE_ANGLE = 0.26, 0.47, 1.4


def surface(angle: Floats) -> Floats:
    """float64[...]: distance of the eye's surface from the ball's middle, in radii of the ball.

    Args:
        angle: float64[...], angle from the gaze in radians.
    """
    curve = CORNEA * IRIS
    ahead = np.cos(_LIMBUS) - np.sqrt(curve**2 - IRIS**2)
    inside = np.maximum(curve**2 - (ahead * np.sin(angle)) ** 2, 0)
    cornea = np.where(angle < np.pi / 2, ahead * np.cos(angle) + np.sqrt(inside), 0.0)
    apart = np.clip(0.5 + (cornea - 1) / (2 * _SOFT), 0, 1)
    return np.asarray(1 + apart * (cornea - 1) + _SOFT * apart * (1 - apart))


def side_map(angle: Floats) -> Floats:
    """float64[...]: distance from the middle of the texture for points outside the iris, in texture
    widths.

    Args:
        angle: float64[...], angle from the gaze in radians, at least the angle of the limbus.
    """
    low = IRIS_AT + (SIDE_AT - IRIS_AT) * (angle - _LIMBUS) / (SIDE_ANGLE - _LIMBUS)
    high = SIDE_AT + (0.5 - SIDE_AT) * (angle - SIDE_ANGLE) / (np.pi - SIDE_ANGLE)
    return np.where(angle < SIDE_ANGLE, low, high)


def side_angle(away: Floats) -> Floats:
    """float64[...]: the angle from the gaze in radians; the inverse of side_map.

    Args:
        away: float64[...], distance from the middle of the texture, at least IRIS_AT.
    """
    low = _LIMBUS + (SIDE_ANGLE - _LIMBUS) * (away - IRIS_AT) / (SIDE_AT - IRIS_AT)
    high = SIDE_ANGLE + (np.pi - SIDE_ANGLE) * (away - SIDE_AT) / (0.5 - SIDE_AT)
    return np.where(away < SIDE_AT, low, np.minimum(high, np.pi))


@dataclass(frozen=True)
class Revolved:
    """A surface of revolution: rings from front to back, with a pole in front or at both ends.

    Attributes:
        away, along: float64[rings], distance from the axis and position along it, in radii of the
            ball.
        map: float64[rings], distance from the middle of the texture.
        poles: (along, map) of the front pole, and of the back pole or None.
    """

    away: Floats
    along: Floats
    map: Floats
    poles: tuple[tuple[float, float], tuple[float, float] | None]

    def _spread(self, away: Floats, along: Floats, ends: list[float]) -> Floats:
        around = np.arange(SEGMENTS) / SEGMENTS * 2 * np.pi
        circle = np.stack([np.cos(around), np.sin(around)], axis=1)
        rings = np.empty((len(away), SEGMENTS, 3))
        rings[:, :, :2] = away[:, None, None] * circle
        rings[:, :, 2] = along[:, None]
        tips = np.zeros((len(ends), 3))
        tips[:, 2] = ends
        return np.concatenate([rings.reshape(-1, 3), tips])

    def points(self) -> Floats:
        """float64[vertices, 3]: positions in radii of the ball, gaze along +z; poles last."""
        return self._spread(self.away, self.along, [p[0] for p in self.poles if p])

    def uvs(self) -> Floats:
        """float64[vertices, 2]: texture coordinates."""
        flat = self._spread(self.map, 0 * self.map, [0.0 for p in self.poles if p])[:, :2]
        flat += 0.5
        if self.poles[1] is not None:
            flat[-1] = (0.5 + self.poles[1][1], 0.5)
        return flat

    def faces(self, first: int, rings: list[int], step: int) -> list[list[int]]:
        """Vertex indices of each face, counter-clockwise from outside.

        Args:
            first: index of the first vertex.
            rings: indices of the rings to use, from front to back.
            step: only every `step`-th vertex of a ring is used.
        """
        out = []
        tip = first + len(self.away) * SEGMENTS
        columns = [(k, (k + step) % SEGMENTS) for k in range(0, SEGMENTS, step)]
        begins = [first + r * SEGMENTS for r in rings]
        for a, b in columns:
            out.append([tip, begins[0] + a, begins[0] + b])
            for near, far in itertools.pairwise(begins):
                out.append([near + a, far + a, far + b, near + b])
            if self.poles[1] is not None:
                out.append([begins[-1] + b, begins[-1] + a, tip + 1])
        return out


def _ball() -> Revolved:
    s = _IRIS_RINGS
    pupil = PUPIL * IRIS
    root = 0.985 * IRIS
    bend = 4 * _MIDDLE - 3 * _RIM - _ROOT
    deep = IRIS * (_RIM + bend * s + (_ROOT - _RIM - bend) * s**2)
    limbus = np.cos(_LIMBUS)
    behind = _LIMBUS + _BEHIND
    end = float(np.pi)
    iris = pupil + s * (root - pupil)
    away = np.concatenate([pupil * np.array([0.85, 0.97]), iris, [IRIS], np.sin(behind)])
    along = np.concatenate(
        [limbus - deep[0] - IRIS * np.array([_HOLE, 0.04]), limbus - deep, [limbus], np.cos(behind)]
    )
    inner = IRIS_AT * PUPIL * np.array([0.85, 0.97])
    at = IRIS_AT * (PUPIL + s * (0.985 - PUPIL))
    places = np.concatenate([inner, at, [IRIS_AT], side_map(behind)])
    bottom = (float(along[0]), 0.0)
    return Revolved(away, along, places, (bottom, (float(np.cos(end)), 0.5)))


def _cornea() -> Revolved:
    angle = _CORNEA_RINGS * _EDGE
    radius = surface(angle) + _CLEAR
    radius[-1] -= 4 * _CLEAR
    top = float(surface(np.zeros(1))[0]) + _CLEAR
    return Revolved(
        radius * np.sin(angle), radius * np.cos(angle), 0.5 * _CORNEA_RINGS, ((top, 0.0), None)
    )


BALL, SHELL = _ball(), _cornea()
_PARTS = (("eyeball", BALL, _COARSE_BALL), ("cornea", SHELL, _COARSE_CORNEA))


def with_eyeballs(base: BaseMesh) -> BaseMesh:
    """The base mesh with additional groups for an eyeball and a cornea on each side (such as
    eyeball-l and cornea-r), and groups for their coarse versions.

    The new vertices are at the origin; `seat` moves them into a face.

    Args:
        base: the base mesh; not changed. A mesh that has eyeballs is returned as it is.
    """
    if "eyeball-l" in base.faces:
        return base
    positions, uvs = [base.positions], [base.uvs]
    faces = dict(base.faces)
    first, first_uv = len(base.positions), len(base.uvs)
    for side in "lr":
        for name, shape, coarse in _PARTS:
            points, places = shape.points(), shape.uvs()
            for ending, rings, step in (
                ("", list(range(len(shape.away))), 1),
                ("-coarse", coarse, 2),
            ):
                corners = shape.faces(0, rings, step)
                faces[f"{name}-{side}{ending}"] = [
                    [(first + c, first_uv + c) for c in face] for face in corners
                ]
            positions.append(np.zeros_like(points))
            uvs.append(places)
            first, first_uv = first + len(points), first_uv + len(places)
    return BaseMesh(np.concatenate(positions), np.concatenate(uvs), faces)


def gaze(side: str) -> Floats:
    """float64[3, 3]: rotation from the ball's axes (gaze +z) to an eye's rest pose in the face.

    The gazes of both eyes meet in front of the face. The matrix is for column vectors.

    Args:
        side: "l" or "r".
    """
    angle = np.radians(CONVERGENCE) * (-1 if side == "l" else 1)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def seat(
    positions: Floats, groups: dict[str, Ints], side: str, middle: Floats, radius: float
) -> None:
    """Places an eyeball and its cornea in a face.

    Args:
        positions: float64[V, 3] in decimetres; the vertices of the eye are changed.
        groups: name of a group of the base mesh -> vertex indices.
        side: "l" or "r".
        middle: float64[3], middle of the ball.
        radius: radius of the ball in decimetres.
    """
    for name, shape, _ in _PARTS:
        positions[groups[f"{name}-{side}"]] = middle + radius * shape.points() @ gaze(side).T


def pupil_wide(radius: float, side: str) -> Floats:
    """float64[ball vertices, 3]: displacement that moves the pupil's rim outwards by the radius of
    the iris.

    The farther out a ring of the iris is, the less it moves; the root of the iris does not move.

    Args:
        radius: radius of the ball in decimetres.
        side: "l" or "r".
    """
    share = np.zeros(len(BALL.away))
    share[:2] = 1
    share[2 : 2 + len(_IRIS_RINGS)] = 1 - _IRIS_RINGS
    way = np.zeros((len(BALL.points()), 3))
    for ring, amount in enumerate(share):
        rows = slice(ring * SEGMENTS, (ring + 1) * SEGMENTS)
        flat = BALL.points()[rows] * [1, 1, 0]
        way[rows] = amount * flat / np.linalg.norm(flat, axis=1, keepdims=True)
    return np.asarray(radius * IRIS * way @ gaze(side).T)
