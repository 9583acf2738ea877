# SPDX-License-Identifier: MIT
"""Computes displacements of lids, lashes, pupils, neck, teeth and tongue that the data lack.

Each function in MOTIONS gets the places of a face and the value `by` of its row in further.toml; it
returns float64[V, 3].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from risorius.base.easing import smooth_step

from ..polygons import Floats
from .places import MM, Places, bell, nearest

Motion = Callable[[Places, object], Floats]
_PUPIL, _IRIS = 9.5, 25.0  # degrees from the gaze of the painted pupil's and iris' rim
_TIP = 0.68  # fraction of the tongue's length at which its tip begins


def _turned(points: Floats, pivot: Floats, degrees: Floats) -> Floats:
    """float64[n, 3]: displacement of points that rotate about a pivot (Rodrigues' formula).

    Args:
        points: float64[n, 3], the points.
        pivot: float64[3] or float64[n, 3], the pivot.
        degrees: float64[n, 3], rotation vector of each point in degrees.
    """
    angle = np.radians(np.linalg.norm(degrees, axis=1))[:, None]
    axis = np.radians(degrees) / np.maximum(angle, 1e-12)
    arm = points - pivot
    along = axis * np.einsum("ij,ij->i", axis, arm)[:, None]
    turned = arm * np.cos(angle) + np.cross(axis, arm) * np.sin(angle)
    return np.asarray(turned + along * (1 - np.cos(angle)) - arm)


def _vector(by: object) -> Floats:
    return np.asarray(by, float)


def _number(by: object) -> float:
    return float(str(by))


def _lid_turn(places: Places, by: object) -> Floats:
    """Rotates about the middle of the eye, so that a lid slides on the ball.

    `by` is 1 (up) or -1 (down). The key `size` of the row in further.toml sets the length of the
    displacement.
    """
    arm = places.positions - places.eye_of()
    way = np.cross(np.array([-1.0, 0, 0]), arm)
    return np.asarray(way * _number(by))


def _lid_press(places: Places, _: object) -> Floats:
    """Presses both lids together, towards the nose and forward, as tightly shut eyes do."""
    upper, lower = places.lids["U"][:, None], places.lids["D"][:, None]
    turn = _lid_turn(places, 1) / 0.15
    inwards = np.zeros_like(turn)
    inwards[:, 0] = -np.sign(places.positions[:, 0])
    out = places.skin[:, None] * places.normals
    return np.asarray(
        lower * turn - 0.35 * upper * turn + (upper + lower) * (0.6 * inwards + 0.5 * out)
    )


def _lashes_up(places: Places, by: object) -> Floats:
    """Rotates upper lashes up: with `by` -1 on the half of the lid at the nose, with 1 on the half
    at the temple."""
    positions, groups = places.positions, places.groups
    out = np.zeros_like(positions)
    for letter in "lr":
        lashes = groups[f"helper-{letter}-eyelashes-2"]
        _, length = nearest(positions[lashes], positions[groups["body"]])
        x = np.abs(positions[lashes, 0])
        aside = (x - x.mean()) / (x.max() - x.mean())
        half = smooth_step(0.5 + _number(by) * aside / 0.8)
        out[lashes] = (length * half)[:, None] * [0.0, 1.0, -0.3]
    return out


def _lashes_down(places: Places, by: object) -> Floats:
    """Rotates upper lashes down: with `by` -1 on the half of the lid at the nose, with 1 on the
    half at the temple."""
    return -_lashes_up(places, by) * np.array([1.0, 1.0, -1.0])


def _pupil(places: Places, by: object) -> Floats:
    """Moves the pupil's rim along the ball: with `by` 1 the pupil becomes wider, with -1 narrower.
    The outer rim of the iris does not move."""
    out = np.zeros_like(places.positions)
    for side, middle in places.eyes.items():
        eye = places.groups[f"helper-{side.lower()}-eye"]
        arm = places.positions[eye] - middle
        ray = arm / np.linalg.norm(arm, axis=1, keepdims=True)
        angle = np.degrees(np.arccos(np.clip(ray[:, 2], -1, 1)))
        rising, falling = angle / _PUPIL, (_IRIS - angle) / (_IRIS - _PUPIL)
        amount = np.clip(np.minimum(rising, falling), 0, 1)
        away = np.column_stack([ray[:, 0], ray[:, 1], np.zeros(len(ray))])
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
        out[eye] = (
            away * ray[:, 2:] - ray * np.hypot(ray[:, :1], ray[:, 1:2]) * [0, 0, 1]
        ) * amount[:, None]
    return out * _number(by)


def _mastoid(places: Places, _: object) -> Floats:
    """Makes the muscle from behind the ear to the breastbone swell."""
    top, bottom = np.array([0.6, 15.55, 0.35]), np.array([0.1, 14.35, 0.72])
    points = places.positions * [1, 1, 1]
    points[:, 0] = np.abs(points[:, 0])
    share = np.clip((points - top) @ (bottom - top) / ((bottom - top) @ (bottom - top)), 0, 1)
    distance = np.linalg.norm(points - (top + share[:, None] * (bottom - top)), axis=1)
    weight = bell(distance / (7 * MM)) * np.sin(np.pi * np.clip(share, 0.05, 0.95))
    return np.asarray((weight * places.skin)[:, None] * places.normals)


def _teeth(group: str) -> Motion:
    def move(places: Places, by: object) -> Floats:
        out = np.zeros_like(places.positions)
        out[places.groups[group]] = _vector(by)
        return out

    return move


def _on_tongue(places: Places) -> tuple[Floats, Floats, Floats]:
    """Indices of the tongue's vertices, their positions, and their place from root 0 to tip 1."""
    tongue = places.groups["helper-tongue"]
    points = places.positions[tongue]
    low, high = points[:, 2].min(), points[:, 2].max()
    return tongue, points, (points[:, 2] - low) / (high - low)


def _of_tongue(places: Places, way: Floats) -> Floats:
    out = np.zeros_like(places.positions)
    out[places.groups["helper-tongue"]] = way
    return out


def _root(points: Floats, share: Floats, begin: float) -> Floats:
    """The middle of the tongue at a fraction of its length, the pivot of all vertices beyond it."""
    near = np.argsort(np.abs(share - begin))[:24]
    return np.asarray(points[near].mean(axis=0) * [0, 1, 1])


def _tongue_way(places: Places, by: object) -> Floats:
    """Shifts the tongue along the vector `by`; towards the root the shift falls to 0. The key
    `size` of the row in further.toml sets the length of the largest displacement."""
    _, _, share = _on_tongue(places)
    return _of_tongue(places, smooth_step(share / 0.6)[:, None] * _vector(by))


def _tongue_rotation(power: float, begin: float) -> Motion:
    def move(places: Places, by: object) -> Floats:
        _, points, share = _on_tongue(places)
        beyond = np.clip((share - begin) / (1 - begin), 0, 1) ** power
        # negated, because a positive rotation about x, to the character's left, is down
        degrees = beyond[:, None] * _vector(by) * [-1, 1, 1]
        return _of_tongue(places, _turned(points, _root(points, share, begin), degrees))

    return move


def _tongue_scale(places: Places, by: object) -> Floats:
    """Scales the tongue's width and height about its middle; its root does not move. `by` has a
    number for each axis: the fraction by which the tongue grows there, negative to shrink."""
    _, points, share = _on_tongue(places)
    middle = np.zeros_like(points)
    for at in np.unique(share.round(2)):
        near = np.abs(share - at) < 0.12
        middle[share.round(2) == at] = points[near].mean(axis=0) * [0, 1, 0]
    arm = (points - middle) * [1, 1, 0]
    return _of_tongue(places, smooth_step(share / 0.5)[:, None] * arm * _vector(by))


def _tongue_roll(places: Places, _: object) -> Floats:
    """Raises the sides of the tongue."""
    _, points, share = _on_tongue(places)
    aside = np.abs(points[:, 0]) / np.abs(points[:, 0]).max()
    way = np.column_stack([-0.35 * np.sign(points[:, 0]) * aside, aside**2, 0 * aside])
    return _of_tongue(places, smooth_step((share - 0.25) / 0.5)[:, None] * way)


def _tongue_press(places: Places, _: object) -> Floats:
    """Presses the middle of the tongue against the palate. The tongue widens, and its tip stays."""
    _, points, share = _on_tongue(places)
    bump = np.exp(-(((share - 0.55) / 0.25) ** 2))
    way = np.column_stack(
        [0.25 * points[:, 0] / np.abs(points[:, 0]).max(), 1 + 0 * share, 0 * share]
    )
    return _of_tongue(places, bump[:, None] * way)


MOTIONS: dict[str, Motion] = {
    "lid_turn": _lid_turn,
    "lid_press": _lid_press,
    "lashes": _lashes_up,
    "lashes_down": _lashes_down,
    "pupil": _pupil,
    "mastoid": _mastoid,
    "teethU": _teeth("helper-upper-teeth"),
    "teethD": _teeth("helper-lower-teeth"),
    "tongue_way": _tongue_way,
    "tongue_turn": _tongue_rotation(0.5, 0.15),
    "tongue_bend": _tongue_rotation(1.0, 0.25),
    "tongue_tip": _tongue_rotation(1.0, _TIP),
    "tongue_scale": _tongue_scale,
    "tongue_roll": _tongue_roll,
    "tongue_press": _tongue_press,
}
