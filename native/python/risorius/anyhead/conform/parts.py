# SPDX-License-Identifier: MIT
"""Finds the rigid parts of a face: the eyeballs and the inside of the mouth."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import Dna, Mesh
from ...author.geometry import skeleton as sk
from ...author.geometry.simplify import pieces_of
from ...author.geometry.skeleton import Doubles, Ints
from ...author.heads.islands import ball_of
from ...web.kinds import kind_of
from ..form.teeth import JawChange
from .change import Change, Similar, similar

_ON_SKIN = re.compile(r"cartilage|caruncle", re.IGNORECASE)
_MOUTH = re.compile(r"saliva", re.IGNORECASE)
_INNER = 0.35  # radii of an eye: joints closer to the eye's centre move with the eye
# In radii of the eye: distance of the lid rims from the eye's centre, and the standard deviation of
# this distance.
_RIM, _BAND = 1.1, 0.03
_STIFF = 0.9  # a vertex moves with the eye if the eye's joints have more of its skin weights
_PRIOR = 0.01  # weight of the surrounding skin against the distance of the lid rims
_ROUNDS = 20


@dataclass(frozen=True)
class Eye:
    """An eyeball.

    Attributes:
        middle: float64[3], the centre on the source head.
        radius: the radius on the source head.
        way: the similarity transform to the target head.
        joints: joints close to its centre, also joints of lids that slide on the eye.
        holds: the joint with more than half of the eyeball's skin weights; empty if none has.
    """

    middle: Doubles
    radius: float
    way: Similar
    joints: frozenset[int]
    holds: frozenset[int]


class Ball(NamedTuple):
    """An eyeball of the target head, in the axes, the unit and the position of the face."""

    middle: Doubles
    radius: float


class Stiff(NamedTuple):
    """The rigid parts of a face.

    Attributes:
        skin: the index of the skin mesh.
        eyes: the eyeballs.
        mouth: the transform of the inside of the mouth to the target head; None: the face has none.
        joint: the index of the jaw joint; -1: none.
        jaw: the change of the lower jaw; None: unknown.
    """

    skin: int
    eyes: Sequence[Eye]
    mouth: Similar | None
    joint: int = -1
    jaw: JawChange | None = None


def kind(name: str) -> str:
    """How a mesh is moved: "eyes", "mouth", or "skin" for a mesh that is bound to the skin.

    Args:
        name: the name of the mesh.
    """
    found = kind_of(name)
    if found in ("teeth", "tongue", "gum") and not _ON_SKIN.search(name):
        return "mouth"
    if found == "wet" and _MOUTH.search(name):
        return "mouth"
    return "eyes" if found == "eyes" else "skin"


def skin_of(dna: Dna) -> int:
    """The index of the skin mesh of LOD 0, the largest if there are several; -1 if there is none.

    Args:
        dna: the face.
    """
    return max(
        (m for m in finest(dna) if kind_of(dna.mesh_names[m]) == "skin"),
        key=lambda m: (len(dna.meshes[m].positions), -m),
        default=-1,
    )


def finest(dna: Dna) -> list[int]:
    """Indices of the meshes of LOD 0 that have vertices."""
    rows, count = dna.lod_mesh_mapping, min(len(dna.meshes), len(dna.mesh_names))
    listed = rows[0].tolist() if len(rows) else range(count)
    return [m for m in listed if m < count and len(dna.meshes[m].positions)]


def mouth_way(dna: Dna, change: Change) -> Similar | None:
    """The common similarity transform of teeth, gums and tongue; None if the face has none.

    Args:
        dna: the source face.
        change: the deformation of its skin.
    """
    own = [
        np.asarray(dna.meshes[m].positions, np.float64)
        for m in finest(dna)
        if kind(dna.mesh_names[m]) == "mouth"
    ]
    if not own:
        return None
    points = np.concatenate(own)
    low, high = points.min(axis=0), points.max(axis=0)
    return change.around((low + high) / 2, float(np.linalg.norm(high - low)) / 2)


def eyes_of(
    dna: Dna,
    change: Change,
    moved: Mapping[str, Doubles],
    world: Doubles,
    balls: Sequence[Ball] = (),
) -> list[Eye]:
    """The eyeballs of a face with their transforms to the target head.

    Args:
        dna: the source face.
        change: the deformation of its skin.
        moved: float64[V, 3] by mesh name, given vertex positions on the target head.
        world: float64[J, 3], world positions of the joints of the source face.
        balls: eyeballs of the target head.
    """
    out: list[Eye] = []
    for m in finest(dna):
        name, mesh = dna.mesh_names[m], dna.meshes[m]
        if kind(name) != "eyes":
            continue
        points = np.asarray(mesh.positions, np.float64)
        for vertices in _balls(mesh, points):
            ball = ball_of(points, vertices, off=0.3)
            middle = points[vertices].mean(axis=0) if ball is None else ball.middle
            far = np.linalg.norm(points[vertices] - middle, axis=1)
            radius = float(np.median(far)) if ball is None else ball.radius
            own = [e for e in out if np.linalg.norm(e.middle - middle) < max(e.radius, radius)]
            if own:
                continue  # the cornea or another layer of the same eye
            joints = np.flatnonzero(np.linalg.norm(world - middle, axis=1) < _INNER * radius)
            if name in moved:
                way = similar(points[vertices], moved[name][vertices], change)
            else:
                way = _in_ball(_in_lids(change, middle, radius), radius, balls)
            holds = _holding(mesh, vertices, len(world))
            out.append(Eye(middle, radius, way, frozenset(joints.tolist()), holds))
    return out


def stiff_share(mesh: Mesh, joints: frozenset[int]) -> npt.NDArray[np.bool_]:
    """bool[V]: True for vertices with nearly all of their skin weight on the joints of an eye.

    Args:
        mesh: gives the skin weights.
        joints: the joints of the eye.
    """
    vertex, joint, weight = sk.skin_entries(mesh)
    own = weight * np.isin(joint, list(joints))
    held = np.bincount(vertex, weights=own, minlength=len(mesh.positions))
    return np.asarray(held > _STIFF)


def _holding(mesh: Mesh, vertices: Ints, joints: int) -> frozenset[int]:
    """The joint with more than half of the sum of the vertices' skin weights; empty if none has."""
    vertex, joint, weight = sk.skin_entries(mesh)
    own = np.isin(vertex, vertices)
    held = np.bincount(joint[own], weights=weight[own], minlength=joints)
    return frozenset(np.flatnonzero(held > held.sum() / 2).tolist())


def _balls(mesh: Mesh, points: Doubles) -> list[Ints]:
    """Vertex indices of each connected piece of a mesh, the largest piece first."""
    label = pieces_of(mesh)
    pieces = [np.flatnonzero(label == k) for k in range(int(label.max()) + 1)]
    return sorted(pieces, key=lambda own: -float(np.ptp(points[own], axis=0).max()))


def _in_ball(way: Similar, radius: float, balls: Sequence[Ball]) -> Similar:
    """The transform to the eyeball of the target head that is nearest to the estimated centre; the
    transform `way` if no eyeball is near."""
    near = [b for b in balls if np.linalg.norm(b.middle - way.becomes) < way.size * radius]
    if not near:
        return way
    ball = min(near, key=lambda b: float(np.linalg.norm(b.middle - way.becomes)))
    linear = ball.radius / (way.size * radius) * way.linear
    return Similar(linear, way.middle, np.asarray(ball.middle, np.float64))


def _in_lids(change: Change, middle: Doubles, radius: float) -> Similar:
    """The transform that keeps the distance between the eyeball and the lid rims in proportion.

    The rims are a narrow band of a sphere, so they determine the centre of the sphere well but not
    its radius. The transform of the skin around the eye is therefore used as a prior, and is
    returned unchanged if fewer than 12 vertices of the rims are visible.
    """
    start = change.around(middle, radius)
    away = change.before.points - middle
    far = np.linalg.norm(away, axis=1)
    share = np.exp(-(((far / radius - _RIM) / _BAND) ** 2) / 2)
    near = np.flatnonzero(share > 1e-3)
    near = near[change.sees(change.before.points[near], away[near] / far[near, None], 3 * radius)]
    if len(near) < 12:
        return start
    far, after = far[near], change.after.points[near]
    share = share[near] / share[near].sum()
    first = np.append(start.becomes, start.size)
    prior = _PRIOR * np.diag([1.0, 1.0, 1.0, radius**2])
    place = first.copy()
    for _ in range(_ROUNDS):
        to = after - place[:3]
        length = np.maximum(np.linalg.norm(to, axis=1), 1e-12)
        rows = np.column_stack([-to / length[:, None], -far])
        off = rows.T @ (share * (length - place[3] * far)) + prior @ (place - first)
        step = np.linalg.solve(rows.T @ (share[:, None] * rows) + prior, off)
        place = place - step
        if np.abs(step[:3]).max() < 1e-9 * radius:
            break
    if place[3] <= 0:
        return start
    return Similar(place[3] * change.turn, middle, place[:3])
